//! Export of the ball model as LaTeX, Python or C.

use super::groups::Groups;
use super::words::{comment, fill};
use super::{
    Language, effect_paragraphs, latex_document, latex_name, latex_number, number, parameter_paragraph,
};
use crate::Usage;
use crate::usage::ModelFault;
use augsim_physics::ball::effects::{SCATTER_KIND, index_of, spec_of};
use augsim_physics::model::{EffectBlock, Model};

const PYTHON: &str = include_str!("ball.py.txt");
const C: &str = include_str!("ball.c.txt");

/// The place in an exported program that an effect of the ball changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    /// The effect changes the velocity of the air (wind).
    Air,
    /// The effect changes the acceleration of the ball in flight.
    Forces,
    /// The effect changes the coefficient of restitution at an impact.
    Bounce,
    /// The effect changes the velocity of the ball along the ground at an impact.
    Friction,
    /// The effect changes the position that the sensor reads.
    Sight,
    /// The effect sets a constant of the program, given by its name in the program.
    Constant(&'static str),
}

/// Program statements of an effect, valid in Python and in C; `{0}` stands for its first parameter.
///
/// `None` for an effect that cannot be written as such statements.
fn statements(kind: &str) -> Option<(Place, &'static [&'static str])> {
    const DRAG: &[&str] =
        &["a[0] = a[0] - {0} * s * u[0];", "a[1] = a[1] - {0} * s * u[1];", "a[2] = a[2] - {0} * s * u[2];"];
    Some(match kind {
        "wind" => (Place::Air, &["air[0] = air[0] + {0};"]),
        "horizontal-acceleration" => (Place::Forces, &["a[0] = a[0] + {0};"]),
        "lateral-acceleration" => (Place::Forces, &["a[1] = a[1] + {0};"]),
        "vertical-acceleration" => (Place::Forces, &["a[2] = a[2] + {0};"]),
        "quadratic-drag" => (Place::Forces, DRAG),
        "linear-drag" => (
            Place::Forces,
            &["a[0] = a[0] - {0} * u[0];", "a[1] = a[1] - {0} * u[1];", "a[2] = a[2] - {0} * u[2];"],
        ),
        "drag-coefficient" => (
            Place::Forces,
            &[
                "a[0] = a[0] - 0.602 * {0} * area_per_mass * s * u[0];",
                "a[1] = a[1] - 0.602 * {0} * area_per_mass * s * u[1];",
                "a[2] = a[2] - 0.602 * {0} * area_per_mass * s * u[2];",
            ],
        ),
        "magnus" => (
            Place::Forces,
            &["a[0] = a[0] + {0} * turn[0];", "a[1] = a[1] + {0} * turn[1];", "a[2] = a[2] + {0} * turn[2];"],
        ),
        "restitution-drift" => (Place::Bounce, &["e = e + {0} * clock;"]),
        "restitution-position" => (Place::Bounce, &["e = e + {0} * p[0];"]),
        "restitution-speed-linear" => (Place::Bounce, &["e = e - {0} * (vn - 3.0);"]),
        "restitution-speed-power" => (Place::Bounce, &["e = e * pow(vn / 3.0, -({0}));"]),
        "coulomb-friction" => (
            Place::Friction,
            &[
                "share = pick(s < 1e-9, stick, fmin({0} * (1.0 + e) * vn / fmax(s, 1e-9), stick));",
                "jump[0] = jump[0] - share * slip[0];",
                "jump[1] = jump[1] - share * slip[1];",
                "jump[2] = jump[2] - share * slip[2];",
            ],
        ),
        "grip-friction" => (
            Place::Friction,
            &[
                "jump[0] = jump[0] - {0} * slip[0];",
                "jump[1] = jump[1] - {0} * slip[1];",
                "jump[2] = jump[2] - {0} * slip[2];",
            ],
        ),
        "height-offset" => (Place::Sight, &["q[2] = q[2] + {0};"]),
        "camera-roll" => (
            Place::Sight,
            &["q[0] = x * cos({0}) - z * sin({0});", "q[2] = q[2] - z + x * sin({0}) + z * cos({0});"],
        ),
        "ground-tilt" => (Place::Constant("GROUND_RAD"), &[]),
        "latency" => (Place::Constant("DELAY_S"), &[]),
        _ => return None,
    })
}

/// Exports the ball model as text in the given language.
pub(super) fn export(model: &Model, language: Language) -> Result<String, Usage> {
    if language == Language::Latex {
        return Ok(latex(model));
    }
    let mut blocks: Vec<&EffectBlock> = model.effects.iter().filter(|b| b.kind != SCATTER_KIND).collect();
    // Additive changes of the restitution act before multiplicative ones, whatever their order in the file.
    blocks.sort_by_key(|b| index_of(&b.kind));
    let mut lines: Vec<(Place, String)> = Vec::new();
    let mut set: Vec<(&str, String)> = Vec::new();
    let effect_parameters = model.effects.iter().flat_map(|b| &b.parameters);
    let mut groups = Groups::new(language, model.parameters.iter().chain(effect_parameters));
    for block in blocks {
        let known = statements(&block.kind).filter(|_| block.table.is_none());
        let Some(((place, list), p)) = known.zip(block.parameters.first()) else {
            let fault = ModelFault::BallEffectExported { kind: block.kind.clone() };
            return Err(Usage::model(&model.file, fault));
        };
        if let Place::Constant(name) = place {
            set.push((name, groups.value(p)));
        }
        let value = groups.value(p);
        lines.extend(list.iter().map(|line| (place, line.replace("{0}", &value))));
    }
    let mut base = |name: &str| {
        let parameter = model.parameters.iter().find(|p| p.name == name);
        parameter.map_or_else(|| number(0.0), |p| groups.value(p))
    };
    let constant = |name: &str| {
        let value = set.iter().find(|(n, _)| *n == name).map(|(_, value)| value.clone());
        value.unwrap_or_else(|| number(0.0))
    };
    let constants = [
        ("GRAVITY", base("gravity_m_s2")),
        ("RESTITUTION", base("restitution")),
        ("RADIUS", base("radius_m")),
        ("INERTIA", base("inertia_ratio")),
        ("FLOOR", base("floor_height_m")),
        ("GROUND_RAD", constant("GROUND_RAD")),
        ("DELAY_S", constant("DELAY_S")),
    ];
    let statements_at = |place: Place| -> String {
        let statements = lines.iter().filter(|(p, _)| *p == place);
        let text: Vec<String> = statements
            .map(|(_, line)| match language {
                Language::C => format!("    {line}"),
                _ => format!("    {}", line.trim_end_matches(';')),
            })
            .collect();
        // Without statements the whole line of the template is removed.
        if text.is_empty() { String::new() } else { text.join("\n") + "\n" }
    };
    let form = if language == Language::C { C } else { PYTHON };
    let mut values = vec![
        ("TITLE", format!("{}{}", title(model), groups.title())),
        ("CONSTANTS", groups.constants(&constants)),
    ];
    for (mark, place) in [
        ("AIR", Place::Air),
        ("FORCES", Place::Forces),
        ("BOUNCE", Place::Bounce),
        ("FRICTION", Place::Friction),
        ("SIGHT", Place::Sight),
    ] {
        values.push((mark, statements_at(place)));
    }
    Ok(fill(form, &values))
}

/// Comment at the top of an exported program: its effects, and that random effects are omitted.
fn title(model: &Model) -> String {
    let kinds: Vec<&str> = model.effects.iter().map(|b| b.kind.as_str()).collect();
    let with = if kinds.is_empty() { "no effect added".to_owned() } else { comment(&kinds.join(", ")) };
    let scatters = kinds.contains(&SCATTER_KIND);
    if scatters { format!("{with} (without the random effects)") } else { with }
}

fn latex(model: &Model) -> String {
    let value = |name: &str| match model.parameters.iter().find(|p| p.name == name) {
        Some(p) if !p.groups.is_empty() => "\\text{by group}".to_owned(),
        p => latex_number(p.map_or(0.0, |p| p.nominal)),
    };
    let mut body = format!(
        "Flight and impact of a ball, whose lowest point is followed:\n\\begin{{align*}}\n\\ddot{{\\mathbf x}} &= -g\\,\\mathbf e_z \
         + \\mathbf a, & g &= {} \\,\\mathrm{{m/s^2}}\\\\\nv_n^+ &= e\\,v_n^-, & e_0 &= {}\n\\end{{align*}}\n",
        value("gravity_m_s2"),
        value("restitution")
    );
    let grouped = model.parameters.iter().filter(|p| !p.groups.is_empty());
    body += &grouped.map(|p| parameter_paragraph(&latex_name(&p.name), p)).collect::<String>();
    body += &effect_paragraphs(&model.effects, |kind| spec_of(kind).map(|s| s.formula));
    latex_document("Model of a ball", &body)
}
