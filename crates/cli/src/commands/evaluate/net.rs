//! `augsim evaluate RUN`: a trained net and the physics that it corrects.

use super::compare::{Fall, verdict};
use super::equations;
use crate::args::{Evaluate, ProtocolArg};
use augsim_discovery::reduction_of_rmse;
use augsim_physics::model::ModelFile;
use augsim_reproduce::experiment::layout::Layout;
use augsim_reproduce::experiment::rows::{Row, table};
use augsim_session::discovery_in;
use augsim_session::run_data::load;
use augsim_session::run_dir::{Config, DataSource, RunDir};
use augsim_session::usage::Inapplicable;
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};
use augsim_trainer::models::Physics;
use augsim_trainer::score::{Score, average};
use augsim_trainer::{
    Correction, Engine, Forecaster, NetModel, Protocol, Sequences, evaluate_reconstruction, forecast_scores,
};
use serde::Serialize;

/// The net's own row, and all rows.
#[derive(Debug, Serialize)]
struct Scored<'a> {
    #[serde(flatten)]
    net: &'a Row,
    /// The physics, and the net below it.
    rows: &'a [Row],
    /// Whether the net helps; absent where it saw the whole trajectory.
    #[serde(skip_serializing_if = "Option::is_none")]
    verdict: Option<String>,
}

/// Scores a net.
pub(super) fn run(args: &Evaluate, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    let run = RunDir::open(&args.run);
    let model = NetModel::new(run.read_model()?)?;
    let settings = &model.state().settings;
    if settings.engine.written().is_some() {
        return equations::run(args, &model, seed, output);
    }
    if settings.correction == Correction::Rollout && args.protocol == ProtocolArg::Reconstruction {
        return Err(Usage::Inapplicable(Inapplicable::ReconstructedPushes).into());
    }
    let test = load(&DataSource::File(args.data.clone()), &settings.engine)?;
    let layout = Layout::of(&settings.engine);
    let physics = physics(&run.read_config()?, &settings.engine, output)?;
    let mut rows = Vec::new();
    let mut last: Vec<Score> = Vec::new();
    for (name, engine) in physics {
        last = forecast_scores(&Physics(engine), &test)?;
        rows.push(Row::new(layout, &name, Protocol::Forecast, &average(&last)));
    }
    let (protocol, score, verdict) = match args.protocol {
        ProtocolArg::Forecast | ProtocolArg::Filtered => {
            let own = forecast_scores(&model, &test)?;
            let verdict = (!last.is_empty()).then(|| helps(&last, &own, &test, seed));
            (Protocol::Forecast, average(&own), verdict)
        }
        ProtocolArg::Reconstruction => {
            (Protocol::Reconstruction, evaluate_reconstruction(&model, &test)?, None)
        }
    };
    rows.push(Row::new(layout, model.name(), protocol, &score));
    if let Some(net) = rows.last() {
        let scored = Scored { net, rows: &rows, verdict };
        output.result(&scored, || {
            let verdict = scored.verdict.as_ref().map_or(String::new(), |v| format!("\n{v}"));
            format!("{}{verdict}", table(&rows).trim_end())
        })?;
    }
    let met = args.require_pos_m.is_none_or(|limit| score.mean_of_10.absolute[0] < limit);
    Ok(if met { Outcome::Done } else { Outcome::CriterionNotMet })
}

/// The physics that the net corrects, by name; before an augmented model the declared and the calibrated one. None for a net
/// that knows no system.
pub(super) fn physics(
    config: &Config,
    engine: &Engine,
    output: &Output,
) -> anyhow::Result<Vec<(String, Engine)>> {
    let mut out = Vec::new();
    if let Some(folder) = &config.residual_of {
        match discovery_in(folder).map(|found| found.models) {
            Some(models) => {
                let texts = [("declared", models.declared_toml), ("calibrated", models.calibrated_toml)];
                for (name, text) in texts {
                    let file = ModelFile::parse(&text, name)?;
                    out.push((format!("Physics {name}"), engine.with_model(&file)?));
                }
            }
            None => output.note(format!(
                "{}: the result of the discovery is gone; the declared and the calibrated model are left out",
                folder.display()
            )),
        }
    }
    let name = if out.is_empty() { "Physics" } else { "Physics augmented" };
    out.push((name.to_owned(), engine.clone()));
    Ok(out)
}

/// The verdict on the net against the physics below it, by the error of the mean in the first measure.
fn helps(physics: &[Score], net: &[Score], test: &Sequences, seed: u64) -> String {
    // One term a trajectory: its mean error, not its square, is what the tables have.
    let list = |scores: &[Score]| -> Vec<(f64, f64)> {
        scores.iter().map(|s| (s.mean.absolute[0] * s.mean.absolute[0], 1.0)).collect()
    };
    let (before, after) = (list(physics), list(net));
    let (_, ci95) = reduction_of_rmse(&before, &after, seed);
    let error = |list: &[(f64, f64)]| (list.iter().map(|e| e.0).sum::<f64>() / list.len() as f64).sqrt();
    let fall = Fall { before: error(&before), after: error(&after), ci95 };
    let unit = if test.columns.first().is_some_and(|c| c.ends_with("_m")) { ("mm", 1e3) } else { ("", 1.0) };
    verdict("the net", "the physics alone", fall, unit.0, unit.1)
}
