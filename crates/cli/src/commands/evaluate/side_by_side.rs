//! `augsim evaluate A B`: errors of two models or nets on the same data, side by side.

use super::compare::compare_sets;
use crate::args::{Evaluate, ProtocolArg};
use crate::commands::own_data::{OwnData, ScoredPart};
use crate::commands::{count_trajectories, note_reading};
use anyhow::Context;
use augsim_data::digits;
use augsim_discovery::{PredictOptions, PredictionSet};
use augsim_session::equations::forecast::NothingToScore;
use augsim_session::predict::{fit_percent, predict, predict_with_net};
use augsim_session::run_dir::RunDir;
use augsim_session::usage::Inapplicable;
use augsim_session::{ModelOrRun, Subject};
use augsim_terminal::output::Output;
use augsim_terminal::progress::Steps;
use augsim_terminal::{Outcome, Usage};
use augsim_trainer::NetModel;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// Number of random draws of each prediction.
///
/// The compared errors are those of the predictions without noise, so the minimum of 2 suffices.
const DRAWS: usize = 2;

/// Errors of both models in one measure that both predict.
#[derive(Debug, Serialize)]
struct Row {
    /// Name of the output of the equations, or of the measure of a ball or push.
    measure: String,
    unit: String,
    /// Root mean square errors of the two models.
    rmse: [f64; 2],
    /// Error of the second model divided by that of the first.
    ratio: f64,
    /// Fit of the two models, %: 100 (1 - error / standard deviation).
    fit_percent: [f64; 2],
    r2: [f64; 2],
}

#[derive(Debug, Serialize)]
struct Compared {
    models: [String; 2],
    trajectories: usize,
    /// Whether only those trajectories of the models' own data are scored to which neither model was fitted.
    held_out: bool,
    /// Whether a model was fitted to the scored trajectories.
    fitted: bool,
    start: String,
    rows: Vec<Row>,
    /// Names of the measures that only one of the models predicts.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    not_compared: Vec<String>,
    /// Sentence that states whether the second model has a smaller error in the first measure.
    verdict: String,
}

/// Scores the two models of `args` on the same trajectories.
pub(super) fn run(
    args: &Evaluate,
    [a, b]: [&Path; 2],
    seed: u64,
    output: &Output,
) -> anyhow::Result<Outcome> {
    if args.protocol != ProtocolArg::Forecast || args.require_pos_m.is_some() {
        return Err(Usage::Inapplicable(Inapplicable::OptionOfTwoModels).into());
    }
    let ScoredPart { only, fitted } = ScoredPart::of([a, b].map(|model| OwnData::find(model, &args.data)));
    let held_out = only.is_some();
    let options = PredictOptions { seed, draws: DRAWS, only };
    let steps = Steps::new(output);
    steps.show_step("forecasting with both models".to_owned());
    let score =
        |path: &Path| predictions(args, path, &options, output).with_context(|| path.display().to_string());
    let sets = [score(a)?, score(b)?];
    steps.finish();
    if sets.iter().any(|set| set.total_coverage(0.5).1 == 0) {
        let (data, burn_in) = (args.measured().to_string(), args.burn_in as usize);
        return Err(NothingToScore { data, burn_in }.into());
    }
    let models = [a, b].map(|path| path.display().to_string());
    let (rows, not_compared) = rows(&sets);
    let verdict = match rows.first() {
        Some(_) => in_words(&models, &sets, seed),
        None => return Err(Usage::Inapplicable(Inapplicable::NothingInCommon).into()),
    };
    let compared = Compared {
        models,
        trajectories: sets[0].records.len(),
        held_out,
        fitted,
        start: sets[0].start.clone(),
        rows,
        not_compared,
        verdict,
    };
    output.result(&compared, || compared_text(&compared))?;
    Ok(Outcome::Done)
}

/// Predicts the data with a model file, a discovery, or a network on equations.
fn predictions(
    args: &Evaluate,
    path: &Path,
    options: &PredictOptions,
    output: &Output,
) -> anyhow::Result<PredictionSet> {
    let (data, burn_in) = (args.measured(), args.burn_in as usize);
    match ModelOrRun::from_path(path)? {
        ModelOrRun::Net => {
            let model = NetModel::new(RunDir::open(path).read_model()?)?;
            if model.state().settings.engine.equation_engine().is_none() {
                return Err(Usage::Inapplicable(Inapplicable::NetBesideModel).into());
            }
            predict_with_net(&model, &data, burn_in, options)
        }
        ModelOrRun::Model { file, .. } => {
            let subject = Subject::read(&file)?;
            if let Subject::Equations(model) = &subject {
                note_reading(&data, model, output)?;
            }
            predict(&subject, &data, burn_in, options)
        }
    }
}

/// Compares the measures that both models predict; also returns the names of the other measures.
fn rows(sets: &[PredictionSet; 2]) -> (Vec<Row>, Vec<String>) {
    let [a, b] = sets;
    let pair = |one: &augsim_discovery::PredictionError| {
        let other = b.errors.iter().find(|e| e.measure == one.measure && e.unit == one.unit)?;
        if !one.rmse.is_finite() || !other.rmse.is_finite() {
            return None;
        }
        let r2 = [a.r2(&one.channels), b.r2(&other.channels)];
        Some(Row {
            measure: one.measure.clone(),
            unit: one.unit.clone(),
            rmse: [one.rmse, other.rmse],
            ratio: other.rmse / one.rmse,
            fit_percent: r2.map(fit_percent),
            r2,
        })
    };
    let rows: Vec<Row> = a.errors.iter().filter_map(pair).collect();
    let mut others: Vec<String> = a.errors.iter().chain(&b.errors).map(|e| e.measure.clone()).collect();
    others.retain(|name| !rows.iter().any(|row| row.measure == *name));
    others.dedup();
    (rows, others)
}

/// Sentence that states whether the second model has a smaller error in the measure that both list first.
fn in_words(models: &[String; 2], [a, b]: &[PredictionSet; 2], seed: u64) -> String {
    let has_same_measure = a.errors.first().map(|e| &e.measure) == b.errors.first().map(|e| &e.measure);
    if !has_same_measure || a.squares.len() != b.squares.len() {
        return "the models do not list the same measure first, so their difference is not tested".to_owned();
    }
    let measure = a.errors.first().map_or("", |e| &e.measure);
    format!("{measure}: {}", compare_sets([&models[0], &models[1]], [a, b], seed))
}

fn compared_text(all: &Compared) -> String {
    let which = match (all.held_out, all.fitted) {
        (true, _) => " that no fit used",
        (_, true) => " that a model was fitted to (errors on new data are larger)",
        _ => "",
    };
    let mut text = format!(
        "forecasts of {}{which} from {}\n  A: {}\n  B: {}",
        count_trajectories(all.trajectories),
        all.start,
        all.models[0],
        all.models[1]
    );
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "\n  {:<20}{:>18}{:>18}{:>8}{:>10}{:>10}{:>9}{:>9}",
        "root mean square", "error of A", "error of B", "B / A", "fit A", "fit B", "R2 A", "R2 B"
    );
    for row in &all.rows {
        let [a, b] = row.rmse.map(|v| format!("{} {}", digits(v), row.unit));
        let [fit_a, fit_b] = row.fit_percent.map(|v| format!("{v:.1} %"));
        let _ = write!(
            text,
            "\n  {:<20}{:>18}{:>18}{:>8.3}{fit_a:>10}{fit_b:>10}{:>9.4}{:>9.4}",
            row.measure,
            a.trim_end(),
            b.trim_end(),
            row.ratio,
            row.r2[0],
            row.r2[1]
        );
    }
    if !all.not_compared.is_empty() {
        let _ = write!(text, "\n  predicted by one of them alone: {}", all.not_compared.join(", "));
    }
    text + "\n" + &all.verdict
}
