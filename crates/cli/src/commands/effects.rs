//! `augsim effects`: lists the effects that can be added to a model.

use crate::args::Effects;
use augsim_equations::library::{Candidate, CandidateParameter, candidates, is_a_kind, similar_kinds};
use augsim_equations::{EquationSystem, Model};
use augsim_physics::library::EffectSpec;
use augsim_physics::model::ModelFile;
use augsim_session::equations::{self, fit, records, unit_text};
use augsim_session::usage::{Inapplicable, UnknownName};
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

#[derive(Debug, Serialize)]
struct List {
    model: String,
    /// Whether the effects have typical values, which come from data or from a built-in library.
    measured: bool,
    effects: Vec<Listed>,
    /// Kind of effect that the user asked for; `None` for all kinds.
    #[serde(skip)]
    kind: Option<String>,
}

#[derive(Debug, Serialize)]
struct Listed {
    kind: String,
    place: String,
    formula: String,
    parameters: Vec<Parameter>,
    /// Columns or events that the data must have for this effect; empty if there is no requirement.
    #[serde(skip_serializing_if = "str::is_empty")]
    needs: &'static str,
    stands_for: Vec<String>,
    source: String,
}

#[derive(Debug, Serialize)]
struct Parameter {
    name: String,
    unit: String,
    /// Typical value, in `unit`; absent for equations without data, because it depends on the motion.
    typical: Option<f64>,
    /// Initial values of the parameter in fits, in `unit` or, without data, in multiples of `grid_of`.
    ///
    /// It is empty for a linear coefficient, whose initial value is the estimate of its test.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    grid: Vec<f64>,
    /// Name of the quantity of which the values of `grid` are multiples; `None` if they are in `unit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    grid_of: Option<String>,
}

/// Runs `augsim effects`: lists the effects that can be added to a model.
pub fn run(args: &Effects, output: &Output) -> anyhow::Result<Outcome> {
    let list = match &args.model {
        Some(model) => list_for_model(model, args.kind.as_deref(), args.data.as_deref())?,
        None => list_libraries(args.kind.as_deref())?,
    };
    output.result(&list, || effect_list_text(&list))?;
    Ok(Outcome::Done)
}

/// Effects of the built-in ball and push models, including the random effects per event.
fn libraries() -> [(&'static str, Vec<&'static EffectSpec>); 2] {
    use augsim_physics::ball::effects;
    use augsim_physics::push::effects as push;
    [
        ("ball", effects::all::<f64>().iter().map(|e| e.spec()).chain([&effects::SCATTER_SPEC]).collect()),
        ("push", push::all::<f64>().iter().map(|e| e.spec()).chain([&push::SCATTER_SPEC]).collect()),
    ]
}

/// Lists the effects of both built-in models, of one of them, or a single effect.
fn list_libraries(kind: Option<&str>) -> anyhow::Result<List> {
    let libraries = libraries();
    let is_requested = |library: &str, spec: &EffectSpec| kind.is_none_or(|k| k == library || k == spec.kind);
    let chosen: Vec<Listed> = libraries
        .iter()
        .flat_map(|(library, specs)| specs.iter().filter(|spec| is_requested(library, spec)))
        .map(|spec| from_built_in(spec))
        .collect();
    if chosen.is_empty() {
        let kind = kind.unwrap_or_default();
        let nearest = [
            augsim_physics::ball::effects::similar_kinds(kind),
            augsim_physics::push::effects::similar_kinds(kind),
        ];
        let nearest = nearest.concat();
        return Err(Usage::Unknown(UnknownName::Effect { name: kind.to_owned(), nearest }).into());
    }
    let model = match kind {
        Some(kind) => kind.to_owned(),
        None => "a ball, then of pushing".to_owned(),
    };
    Ok(List { model, measured: true, effects: chosen, kind: None })
}

fn list_for_model(path: &Path, kind: Option<&str>, data: Option<&Path>) -> anyhow::Result<List> {
    let effects = if equations::is_model(path) {
        list_for_equations(path, kind, data)?
    } else {
        if data.is_some() {
            return Err(Usage::Inapplicable(Inapplicable::SizesOfBuiltIn).into());
        }
        list_for_built_in_model(path, kind)?
    };
    let measured = data.is_some() || !equations::is_model(path);
    let kind = kind.map(str::to_owned);
    Ok(List { model: path.display().to_string(), measured, effects, kind })
}

/// Lists the effects for a model of a ball or of pushing.
fn list_for_built_in_model(path: &Path, kind: Option<&str>) -> anyhow::Result<Vec<Listed>> {
    let (library, similar_kinds): (_, fn(&str) -> Vec<&'static str>) = match ModelFile::read(path)? {
        ModelFile::Ball(_) => ("ball", augsim_physics::ball::effects::similar_kinds),
        ModelFile::Push(_) => ("push", augsim_physics::push::effects::similar_kinds),
    };
    let specs = libraries().into_iter().filter(|(name, _)| *name == library).flat_map(|(_, specs)| specs);
    let is_requested = |spec: &&EffectSpec| kind.is_none_or(|kind| kind == spec.kind);
    let chosen: Vec<Listed> = specs.filter(is_requested).map(from_built_in).collect();
    match kind {
        Some(kind) if chosen.is_empty() => {
            let nearest = similar_kinds(kind).into_iter().map(str::to_owned).collect();
            Err(unknown(path, kind, nearest))
        }
        _ => Ok(chosen),
    }
}

/// Lists the effects for a model of equations, with the candidates that the model file declares.
///
/// They have typical values if there are data.
fn list_for_equations(path: &Path, kind: Option<&str>, data: Option<&Path>) -> anyhow::Result<Vec<Listed>> {
    let model = equations::read(path)?;
    let all = match data {
        None => candidates(&model)?,
        Some(data) => measured_candidates(&model, data)?,
    };
    let is_requested = |c: &&Candidate| kind.is_none_or(|kind| kind == c.kind || kind == c.name);
    let chosen: Vec<Listed> =
        all.iter().filter(is_requested).map(|c| from_candidate(c, data.is_some())).collect();
    match kind {
        Some(kind) if chosen.is_empty() && is_a_kind(kind, &model) => {
            let (kind, model) = (kind.to_owned(), path.to_owned());
            Err(Usage::Unknown(UnknownName::PlaceOfEffect { kind, model }).into())
        }
        Some(kind) if chosen.is_empty() => Err(unknown(path, kind, similar_kinds(kind, &all))),
        _ => Ok(chosen),
    }
}

fn unknown(model: &Path, name: &str, nearest: Vec<String>) -> anyhow::Error {
    Usage::Unknown(UnknownName::EffectOn { name: name.to_owned(), model: model.to_owned(), nearest }).into()
}

/// Returns the effects that can be added to a model of equations, with typical values from the data.
fn measured_candidates(model: &Model, data: &Path) -> anyhow::Result<Vec<Candidate>> {
    let measured = records::read(data, model)?;
    let list = records::records(&measured.data, model, true)?;
    let list = fit::prepare_records(&EquationSystem::declared_only(model)?, &list)?;
    let scales = EquationSystem::declared_only(model)?.tuned(&list)?.scales(&list);
    let mut all = candidates(model)?;
    all.iter_mut().for_each(|candidate| scales.resolve(candidate, model));
    Ok(all)
}

fn from_built_in(spec: &EffectSpec) -> Listed {
    let effect = augsim_system::Effect::from(spec);
    let parameter = |p: &augsim_system::EffectParameter| Parameter {
        name: p.name.clone(),
        unit: p.unit.clone(),
        typical: Some(p.typical),
        grid: Vec::new(),
        grid_of: None,
    };
    Listed {
        parameters: effect.parameters.iter().map(parameter).collect(),
        kind: effect.kind,
        place: effect.location,
        formula: effect.formula,
        needs: spec.needs.description(),
        stands_for: effect.equivalent_causes,
        source: effect.source,
    }
}

fn from_candidate(candidate: &Candidate, measured: bool) -> Listed {
    let parameter = |p: &CandidateParameter| Parameter {
        name: p.name.clone(),
        unit: unit_text(p.unit).trim().to_owned(),
        typical: measured.then(|| p.typical.unwrap_or(1.0)),
        grid: if p.scan.is_empty() { p.grid.clone() } else { p.scan.clone() },
        grid_of: candidate.size_of(p),
    };
    Listed {
        kind: candidate.name.clone(),
        place: candidate.on.clone(),
        formula: candidate.formula.clone(),
        parameters: candidate.parameters.iter().filter(|p| !p.frozen).map(parameter).collect(),
        needs: "",
        stands_for: candidate.equivalent_causes.clone(),
        source: candidate.source.clone(),
    }
}

/// Formats a parameter of an effect: name, typical value or unit, and initial values of fits.
fn parameter_text(p: &Parameter) -> String {
    let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
    let size = match p.typical {
        Some(typical) => format!("{} about {typical:.3e}{unit}", p.name),
        None if p.unit.is_empty() => p.name.clone(),
        None => format!("{} in{unit}", p.name),
    };
    let values: Vec<String> = p.grid.iter().map(|value| number(*value)).collect();
    match (&p.grid_of, &values[..]) {
        (_, []) => size,
        (Some(quantity), _) => format!("{size} (fits start at {} times {quantity})", values.join(", ")),
        (None, _) => format!("{size} (fits start at {}{unit})", values.join(", ")),
    }
}

/// Formats a number with three significant digits and no trailing zeros.
fn number(value: f64) -> String {
    let digits: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    format!("{digits}")
}

fn headline(list: &List) -> String {
    let count = list.effects.len();
    let effects = if count == 1 { "effect" } else { "effects" };
    match (&list.kind, list.model.as_str()) {
        (Some(kind), model) => {
            let places = if count == 1 { "place" } else { "places" };
            format!("{kind} can be added to {model} in {count} {places}")
        }
        (None, "ball" | "push" | "a ball, then of pushing") => format!("{count} {effects} of {}", list.model),
        (None, model) if count == 1 => model.to_owned(),
        (None, model) => format!("{count} {effects} can be added to {model}"),
    }
}

fn effect_list_text(list: &List) -> String {
    let mut text = headline(list) + "\n";
    for effect in &list.effects {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}\n  {}", effect.kind, effect.formula);
        let parameters: Vec<String> = effect.parameters.iter().map(parameter_text).collect();
        let _ = writeln!(text, "  {}", parameters.join(", "));
        if !effect.needs.is_empty() {
            let _ = writeln!(text, "  needs: {}", effect.needs);
        }
        if !effect.stands_for.is_empty() {
            let _ = writeln!(text, "  equivalent on some data: {}", effect.stands_for.join("; "));
        }
        if !effect.source.is_empty() && effect.source != "-" {
            let _ = writeln!(text, "  source: {}", effect.source);
        }
    }
    if !list.measured {
        let _ = writeln!(text, "add --data FILE to see typical values");
    }
    text
}
