//! `augsim evaluate MODEL` for balls and pushes, and for discovery folders: a table of all their models.

use super::compare::compare_sets;
use crate::args::Evaluate;
use crate::commands::note_reading;
use crate::commands::own_data::{OwnData, ScoredPart};
use augsim_data::estimate_digits;
use augsim_discovery::{PredictOptions, PredictionSet};
use augsim_session::equations::forecast::NothingToScore;
use augsim_session::predict::{MeasureScores, measure_scores};
use augsim_session::usage::Inapplicable;
use augsim_session::{Subject, discovery_in, predict};
use augsim_terminal::output::Output;
use augsim_terminal::progress::Steps;
use augsim_terminal::{Outcome, Usage};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// Scores of the forecasts of one model in one measure.
#[derive(Debug, Serialize)]
struct Row {
    model: &'static str,
    #[serde(flatten)]
    scores: MeasureScores,
}

#[derive(Debug, Serialize)]
struct Scored {
    trajectories: usize,
    /// Whether only the trajectories that the discovery held out of its own data are scored.
    held_out: bool,
    /// Whether the models were fitted to the scored trajectories, because the discovery held none out.
    fitted: bool,
    /// Description of the samples from which the initial states were estimated.
    start: String,
    rows: Vec<Row>,
    /// Sentence that states whether the discovered effects improve the forecasts; absent for a model file alone.
    verdict: Option<String>,
}

/// Scores the model in `file` and, for a discovery folder, its declared and calibrated models as well.
pub(super) fn run(
    args: &Evaluate,
    file: &Path,
    folder: Option<&Path>,
    seed: u64,
    output: &Output,
) -> anyhow::Result<Outcome> {
    let ScoredPart { only, fitted } = ScoredPart::of([OwnData::find(file, &args.data)]);
    let held_out = only.is_some();
    let options = PredictOptions { seed, draws: predict::DRAWS, only };
    let data = args.measured();
    let score = |model: &Subject| predict::predict(model, &data, args.burn_in as usize, &options);
    let steps = Steps::new(output);
    steps.show_step(format!("forecasting with {} draws of each trajectory", predict::DRAWS));
    let mut scored: Vec<(&'static str, PredictionSet)> = Vec::new();
    if let Some(found) = folder.and_then(discovery_in) {
        let models = &found.models;
        for (name, text) in [("declared", &models.declared_toml), ("calibrated", &models.calibrated_toml)] {
            // Its file is in the folder, where the description of a robot is found.
            let place = file.with_file_name(name).display().to_string();
            scored.push((name, score(&Subject::parse(text, &place)?)?));
        }
    }
    let name = if scored.is_empty() { "model" } else { "augmented" };
    let subject = Subject::read(file)?;
    scored.push((name, score(&subject)?));
    steps.finish();
    if let Subject::Equations(model) = &subject {
        note_reading(&data, model, output)?;
    }
    if scored.iter().all(|(_, f)| f.total_coverage(0.5).1 == 0) {
        let (data, burn_in) = (data.to_string(), args.burn_in as usize);
        return Err(NothingToScore { data, burn_in }.into());
    }
    let rows = scored.iter().flat_map(|(name, f)| rows(name, f)).collect();
    let verdict = discovery_verdict(&scored, seed);
    let last = scored.last().map(|(_, f)| f);
    let trajectories = last.map_or(0, |f| f.records.len());
    let start = last.map_or_else(String::new, |f| f.start.clone());
    let all = Scored { trajectories, held_out, fitted, start, rows, verdict };
    output.result(&all, || model_score_text(&all))?;
    check_criterion(args, last)
}

/// Checks the position error, m, against the limit that `--require-pos-m` gives.
fn check_criterion(args: &Evaluate, scored: Option<&PredictionSet>) -> anyhow::Result<Outcome> {
    let Some(limit) = args.require_pos_m else { return Ok(Outcome::Done) };
    let position = scored.and_then(|f| f.errors.first()).filter(|e| e.unit == "m");
    let Some(position) = position else {
        return Err(Usage::Inapplicable(Inapplicable::PositionUnmeasured).into());
    };
    Ok(if position.rmse < limit { Outcome::Done } else { Outcome::CriterionNotMet })
}

fn rows(model: &'static str, scored: &PredictionSet) -> Vec<Row> {
    measure_scores(scored).into_iter().map(|scores| Row { model, scores }).collect()
}

fn discovery_verdict(scored: &[(&'static str, PredictionSet)], seed: u64) -> Option<String> {
    let [.., (_, calibrated), (_, augmented)] = scored else { return None };
    Some(compare_sets(["the calibrated model", "the discovered model"], [calibrated, augmented], seed))
}

fn model_score_text(all: &Scored) -> String {
    let which = match (all.held_out, all.fitted) {
        (true, _) => "trajectories that the discovery kept out of all fits",
        (false, true) => {
            "trajectories that the models were fitted to (none was held out: errors on new data are larger)"
        }
        (false, false) => "trajectories",
    };
    let mut text = format!("forecasts of {} {which} from {}", all.trajectories, all.start);
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "\n  {:<12}{:<10}{:>14}  {:<28}{:>9}{:>9}{:>9}{:>9}",
        "model", "of", "error", "95 % interval", "fit", "R2", "in 50 %", "in 90 %"
    );
    for Row { model, scores: r } in &all.rows {
        let (unit, scale) = if r.unit == "m" { ("mm", 1e3) } else { (r.unit.as_str(), 1.0) };
        let [value, low, high] = estimate_digits(scale * r.rmse, r.ci95.map(|v| scale * v));
        let _ = write!(
            text,
            "\n  {:<12}{:<10}{:>14}  {:<28}{:>8.1}%{:>9.4}{:>8.1}%{:>8.1}%",
            model,
            r.measure,
            format!("{value} {unit}"),
            format!("{low} to {high} {unit}"),
            r.fit_percent,
            r.r2,
            100.0 * r.coverage50,
            100.0 * r.coverage90
        );
    }
    if let Some(verdict) = &all.verdict {
        let _ = write!(text, "\n{verdict}");
    }
    text
}
