//! `augsim effects`: what may be tried on a model.

use crate::args::Effects;
use crate::exit::{Outcome, Usage};
use crate::output::Output;
use augsim_physics::model::ModelFile;
use augsim_physics::system::{Effect, System};
use augsim_session::written::{self, fit, records};
use augsim_written::WrittenSystem;
use augsim_written::library::Scales;
use serde::Serialize;
use std::fmt::Write;

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
    let (library, measured) = if written::is_model(&args.model) {
        let model = written::read(&args.model)?;
        let scales = match &args.data {
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
        (described.cloned().collect::<Vec<Effect>>(), args.data.is_some())
    } else {
        if args.data.is_some() {
            let text = "--data gives sizes to models of equations; effects of the ball and of pushing have their own";
            return Err(Usage(text.to_owned()).into());
        }
        let effects = match ModelFile::read(&args.model)? {
            ModelFile::Ball(_) => {
                augsim_physics::effects::all::<f64>().iter().map(|e| Effect::from(e.spec())).collect()
            }
            ModelFile::Push(_) => {
                augsim_physics::push::effects::all::<f64>().iter().map(|e| Effect::from(e.spec())).collect()
            }
        };
        (effects, true)
    };
    let listed = |effect: &Effect| Listed {
        kind: effect.kind.clone(),
        place: effect.place.clone(),
        formula: effect.formula.clone(),
        parameters: effect
            .parameters
            .iter()
            .map(|p| Parameter {
                name: p.name.clone(),
                unit: p.unit.clone(),
                typical: measured.then_some(p.typical),
            })
            .collect(),
        stands_for: effect.stands_for.clone(),
        source: effect.source.clone(),
    };
    let model = args.model.display().to_string();
    let list = List { model, measured, effects: library.iter().map(listed).collect() };
    output.result(&list, || told(&list))?;
    Ok(Outcome::Done)
}

fn told(list: &List) -> String {
    let mut text = format!("{} effects may be tried on {}\n", list.effects.len(), list.model);
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
