//! Export of the pushing model as LaTeX, Python or C.

use super::groups::Groups;
use super::words::{comment, fill};
use super::{Language, effect_paragraphs, latex_document, number, parameter_paragraph};
use crate::Usage;
use crate::usage::ModelFault;
use augsim_physics::model::{EffectBlock, PushModel};
use augsim_physics::push::effects::{SCATTER_KIND, spec_of};

const PYTHON: &str = include_str!("push.py.txt");
const C: &str = include_str!("push.c.txt");

/// Number of sides of the polygon that approximates an ellipse in a program.
const ELLIPSE_SIDES: usize = 360;

/// Names of the program constants that an effect sets, in the order of the effect's parameters.
///
/// `None` for an effect that cannot be expressed by constants.
fn constants_of(kind: &str) -> Option<&'static [&'static str]> {
    Some(match kind {
        "frame-registration" => &["FRAME_SCALE", "FRAME_RAD", "FRAME_X", "FRAME_Y"],
        "tip-offset" => &["FRAME_X", "FRAME_Y"],
        "pose-offset" => &["OFFSET_X", "OFFSET_Y", "OFFSET_RAD"],
        _ => return None,
    })
}

/// Exports the pushing model as text in the given language.
pub(super) fn export(model: &PushModel, language: Language) -> Result<String, Usage> {
    if language == Language::Latex {
        return Ok(latex(model));
    }
    let effect_parameters = model.effects.iter().flat_map(|b| &b.parameters);
    let mut groups = Groups::new(language, model.parameters.iter().chain(effect_parameters));
    let mut base = |name: &str| {
        let parameter = model.parameters.iter().find(|p| p.name == name);
        parameter.map_or_else(|| number(0.0), |p| groups.value(p))
    };
    let mut constants = vec![
        ("C", base("c_m")),
        ("FRICTION", base("contact_friction")),
        ("RADIUS", base("rod_radius_m")),
        ("FRAME_SCALE", number(0.0)),
        ("FRAME_RAD", number(0.0)),
        ("FRAME_X", number(0.0)),
        ("FRAME_Y", number(0.0)),
        ("OFFSET_X", number(0.0)),
        ("OFFSET_Y", number(0.0)),
        ("OFFSET_RAD", number(0.0)),
    ];
    for block in model.effects.iter().filter(|b| b.kind != SCATTER_KIND) {
        let Some(names) = constants_of(&block.kind) else {
            let fault = ModelFault::PushEffectExported { kind: block.kind.clone() };
            return Err(Usage::model(&model.file, fault));
        };
        for (name, p) in names.iter().zip(&block.parameters) {
            let expression = groups.value(p);
            let set = constants.iter_mut().filter(|(n, _)| n == name);
            set.for_each(|(_, value)| value.clone_from(&expression));
        }
    }
    let polygon = model.object.outline.polygon(ELLIPSE_SIDES);
    let vertex = |[x, y]: &[f64; 2]| match language {
        Language::C => format!("{{{}, {}}}", number(*x), number(*y)),
        _ => format!("({}, {})", number(*x), number(*y)),
    };
    let vertices: Vec<String> = polygon.vertices().iter().map(vertex).collect();
    let form = if language == Language::C { C } else { PYTHON };
    Ok(fill(
        form,
        &[
            ("TITLE", format!("{}{}", title(model), groups.title())),
            ("SIDES", vertices.len().to_string()),
            ("POLYGON", vertices.join(", ")),
            ("CONSTANTS", groups.constants(&constants)),
        ],
    ))
}

/// Comment at the top of an exported program: the object, its effects, and what is omitted.
fn title(model: &PushModel) -> String {
    let kinds: Vec<&str> = model.effects.iter().map(|b: &EffectBlock| b.kind.as_str()).collect();
    let with = if kinds.is_empty() { String::new() } else { format!(" with {}", kinds.join(", ")) };
    let scatters = kinds.contains(&SCATTER_KIND);
    let random = if scatters { " (without the random effects)" } else { "" };
    format!("{}{}{random}", comment(&model.object.name), comment(&with))
}

fn latex(model: &PushModel) -> String {
    let mut body = String::from(
        "Quasi-static pushing on an ellipsoidal limit surface (Goyal, Ruina and Papadopoulos 1991; Lynch, Maekawa and Tanie 1992): \
         $\\mathbf f$ is the force of the rod at the point $\\mathbf r$ from the centroid, $\\mathbf n$ the normal into the object, \
         $\\mathbf u$ the velocity of the rod.\n\\begin{align*}\n\
         (\\mathbf v, \\omega) &\\propto (\\mathbf f, \\tau / c^2), & \\tau &= \\mathbf r \\times \\mathbf f\\\\\n\
         \\mathbf v + \\omega\\, \\mathbf e_z \\times \\mathbf r &= \\mathbf u \\quad\\text{(sticking)} \
         & \\text{while } |f_t| &\\le \\mu f_n\\\\\n\
         \\mathbf n \\cdot (\\mathbf v + \\omega\\, \\mathbf e_z \\times \\mathbf r) &= \\mathbf n \\cdot \\mathbf u \
         \\quad\\text{(sliding)} & |f_t| &= \\mu f_n\n\\end{align*}\n",
    );
    let symbols = [("c_m", "c"), ("contact_friction", "\\mu"), ("rod_radius_m", "\\text{radius of the rod}")];
    for (name, symbol) in symbols {
        if let Some(p) = model.parameters.iter().find(|p| p.name == name) {
            body += &parameter_paragraph(symbol, p);
        }
    }
    body += &effect_paragraphs(&model.effects, |kind| spec_of(kind).map(|s| s.formula));
    latex_document(&format!("Model of a pushed object: {}", model.object.name), &body)
}
