//! `augsim effects`: what may be tried on a model.

use crate::args::Effects;
use crate::exit::{Outcome, Usage};
use crate::output::Output;
use augsim_physics::effects::EffectSpec;
use augsim_physics::model::ModelFile;
use augsim_physics::system::{Effect, EffectParameter, System};
use augsim_session::usage::{Inapplicable, UnknownName};
use augsim_session::written::{self, fit, records};
use augsim_written::WrittenSystem;
use augsim_written::library::Scales;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

#[derive(Debug, Serialize)]
struct List {
    model: String,
    /// Whether usual sizes are those of data.
    measured: bool,
    effects: Vec<Listed>,
}

#[derive(Debug, Serialize)]
struct Listed {
    kind: String,
    place: String,
    formula: String,
    parameters: Vec<Parameter>,
    /// Columns or events that the data must have; empty where nothing special is needed.
    #[serde(skip_serializing_if = "str::is_empty")]
    needs: &'static str,
    stands_for: Vec<String>,
    source: String,
}

#[derive(Debug, Serialize)]
struct Parameter {
    name: String,
    unit: String,
    /// Absent for equations without data: sizes follow from what the system does.
    typical: Option<f64>,
}

/// Runs the subcommand.
pub fn run(args: &Effects, output: &Output) -> anyhow::Result<Outcome> {
    let list = match &args.model {
        Some(model) => of_model(model, args.data.as_deref())?,
        None => of_libraries(args.kind.as_deref())?,
    };
    output.result(&list, || effect_list_text(&list))?;
    Ok(Outcome::Done)
}

/// The libraries of the built-in systems, scatter included.
fn libraries() -> [(&'static str, Vec<&'static EffectSpec>); 2] {
    use augsim_physics::{effects, push::effects as push};
    [
        ("ball", effects::all::<f64>().iter().map(|e| e.spec()).chain([&effects::SCATTER_SPEC]).collect()),
        ("push", push::all::<f64>().iter().map(|e| e.spec()).chain([&push::SCATTER_SPEC]).collect()),
    ]
}

/// Both libraries, one of them, or one effect.
fn of_libraries(kind: Option<&str>) -> anyhow::Result<List> {
    let libraries = libraries();
    let wanted = |library: &str, spec: &EffectSpec| kind.is_none_or(|k| k == library || k == spec.kind);
    let chosen: Vec<Listed> = libraries
        .iter()
        .flat_map(|(library, specs)| specs.iter().filter(|spec| wanted(library, spec)))
        .map(|spec| Listed { needs: spec.needs.words(), ..listed(&Effect::from(*spec), true) })
        .collect();
    if chosen.is_empty() {
        let kind = kind.unwrap_or_default();
        let nearest =
            [augsim_physics::effects::kinds_like(kind), augsim_physics::push::effects::kinds_like(kind)];
        let nearest = nearest.concat();
        return Err(Usage::Unknown(UnknownName::Effect { name: kind.to_owned(), nearest }).into());
    }
    let model = match kind {
        Some(kind) => kind.to_owned(),
        None => "a ball, then of pushing".to_owned(),
    };
    Ok(List { model, measured: true, effects: chosen })
}

fn of_model(path: &Path, data: Option<&Path>) -> anyhow::Result<List> {
    let (library, measured) = if written::is_model(path) {
        let model = written::read(path)?;
        let scales = match data {
            None => Scales::default(),
            Some(data) => {
                let measured = records::read(data, &model)?;
                let list = records::records(&measured.data, &model, true)?;
                let system = WrittenSystem::declared_only(&model)?;
                let list = fit::prepared(&system, &list)?;
                system.tuned(&list)?.scales(&list)
            }
        };
        let system = WrittenSystem::new(&model, &scales)?;
        let described = system.library().iter().filter(|effect| effect.grammar.is_none());
        (described.cloned().collect::<Vec<Effect>>(), data.is_some())
    } else {
        if data.is_some() {
            return Err(Usage::Inapplicable(Inapplicable::SizesOfBuiltIn).into());
        }
        let library = match ModelFile::read(path)? {
            ModelFile::Ball(_) => "ball",
            ModelFile::Push(_) => "push",
        };
        return Ok(List { model: path.display().to_string(), ..of_libraries(Some(library))? });
    };
    let effects = library.iter().map(|effect| listed(effect, measured)).collect();
    Ok(List { model: path.display().to_string(), measured, effects })
}

fn listed(effect: &Effect, measured: bool) -> Listed {
    let parameter = |p: &EffectParameter| Parameter {
        name: p.name.clone(),
        unit: p.unit.clone(),
        typical: measured.then_some(p.typical),
    };
    Listed {
        kind: effect.kind.clone(),
        place: effect.place.clone(),
        formula: effect.formula.clone(),
        parameters: effect.parameters.iter().map(parameter).collect(),
        needs: "",
        stands_for: effect.stands_for.clone(),
        source: effect.source.clone(),
    }
}

fn effect_list_text(list: &List) -> String {
    let count = list.effects.len();
    let effects = if count == 1 { "effect" } else { "effects" };
    let mut text = match list.model.as_str() {
        "ball" | "push" | "a ball, then of pushing" => format!("{count} {effects} of {}\n", list.model),
        model if count == 1 => format!("{model}\n"),
        model => format!("{count} {effects} may be tried on {model}\n"),
    };
    for effect in &list.effects {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}\n  {}", effect.kind, effect.formula);
        let parameter = |p: &Parameter| {
            let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
            match p.typical {
                Some(typical) => format!("{} about {typical:.3e}{unit}", p.name),
                None if p.unit.is_empty() => p.name.clone(),
                None => format!("{} in{unit}", p.name),
            }
        };
        let parameters: Vec<String> = effect.parameters.iter().map(parameter).collect();
        let _ = writeln!(text, "  {}", parameters.join(", "));
        if !effect.needs.is_empty() {
            let _ = writeln!(text, "  needs: {}", effect.needs);
        }
        if !effect.stands_for.is_empty() {
            let _ = writeln!(text, "  could look the same: {}", effect.stands_for.join("; "));
        }
        if !effect.source.is_empty() && effect.source != "-" {
            let _ = writeln!(text, "  source: {}", effect.source);
        }
    }
    if !list.measured {
        let _ = writeln!(text, "add --data FILE for usual sizes");
    }
    text
}
