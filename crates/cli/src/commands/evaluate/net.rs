//! `augsim evaluate RUN`: scores a trained network and the physics model that it corrects.

use super::compare::{ErrorReduction, verdict};
use super::equation_net;
use crate::args::{Evaluate, ProtocolArg};
use augsim_discovery::rmse_reduction;
use augsim_physics::model::ModelFile;
use augsim_reproduce::experiment::layout::Layout;
use augsim_reproduce::experiment::rows::{Row, table};
use augsim_session::discovery_in;
use augsim_session::run_data::load_measured;
use augsim_session::run_dir::{Config, RunDir};
use augsim_session::usage::Inapplicable;
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};
use augsim_trainer::models::Physics;
use augsim_trainer::score::{Score, average};
use augsim_trainer::{
    Correction, Engine, Forecaster, NetModel, Protocol, Sequences, evaluate_reconstruction, forecast_scores,
};
use serde::Serialize;

/// Output of the evaluation of a network: its score, and all rows of the table.
#[derive(Debug, Serialize)]
struct Scored<'a> {
    #[serde(flatten)]
    net: &'a Row,
    /// Scores of the physics models, then of the network.
    rows: &'a [Row],
    /// Sentence that states whether the network improves the forecasts; absent if it used the whole trajectory.
    #[serde(skip_serializing_if = "Option::is_none")]
    verdict: Option<String>,
}

/// Scores a trained network and the physics model that it corrects.
pub(super) fn run(args: &Evaluate, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    let run = RunDir::open(args.model());
    let model = NetModel::new(run.read_model()?)?;
    let settings = &model.state().settings;
    if settings.engine.equation_engine().is_some() {
        return equation_net::run(args, &model, seed, output);
    }
    if settings.correction == Correction::Rollout && args.protocol == ProtocolArg::Reconstruction {
        return Err(Usage::Inapplicable(Inapplicable::ReconstructedPushes).into());
    }
    let test = load_measured(&args.measured(), &settings.engine)?;
    let layout = Layout::for_engine(&settings.engine);
    let physics = physics(&run.read_config()?, &settings.engine, output)?;
    let mut rows = Vec::new();
    let mut last: Vec<Score> = Vec::new();
    for (name, engine) in physics {
        last = forecast_scores(&Physics(engine), &test)?;
        rows.push(Row::new(layout, &name, Protocol::Forecast, &average(&last)));
    }
    let (protocol, score, verdict) = match args.protocol {
        ProtocolArg::Forecast | ProtocolArg::Filtered => {
            let net_scores = forecast_scores(&model, &test)?;
            let verdict = (!last.is_empty()).then(|| network_verdict(&last, &net_scores, &test, seed));
            (Protocol::Forecast, average(&net_scores), verdict)
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
    let is_met = args.require_pos_m.is_none_or(|limit| score.mean_of_10.absolute[0] < limit);
    Ok(if is_met { Outcome::Done } else { Outcome::CriterionNotMet })
}

/// Returns the physics model that the network corrects, with its name in the table.
///
/// For a discovered model the declared and the calibrated models come first.
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
                "{}: the result of the discovery was not found, so the declared and the calibrated model are not scored",
                folder.display()
            )),
        }
    }
    let name = if out.is_empty() { "Physics" } else { "Physics augmented" };
    out.push((name.to_owned(), engine.clone()));
    Ok(out)
}

/// Sentence that compares the mean forecasts of the network and the physics model in the first measure.
fn network_verdict(physics: &[Score], net: &[Score], test: &Sequences, seed: u64) -> String {
    // The tables show the mean error of each trajectory, so each trajectory contributes one squared mean
    // error.
    let list = |scores: &[Score]| -> Vec<(f64, f64)> {
        scores.iter().map(|s| (s.mean.absolute[0] * s.mean.absolute[0], 1.0)).collect()
    };
    let (before, after) = (list(physics), list(net));
    let (_, ci95) = rmse_reduction(&before, &after, seed);
    let error = |list: &[(f64, f64)]| (list.iter().map(|e| e.0).sum::<f64>() / list.len() as f64).sqrt();
    let reduction = ErrorReduction { before: error(&before), after: error(&after), ci95 };
    let unit = if test.columns.first().is_some_and(|c| c.ends_with("_m")) { ("mm", 1e3) } else { ("", 1.0) };
    verdict("the net", "the physics alone", reduction, unit.0, unit.1)
}
