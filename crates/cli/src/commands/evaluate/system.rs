//! `augsim evaluate MODEL.toml`: scores the free run of a model of equations.

use crate::args::Evaluate;
use crate::commands::own_data::{OwnData, ScoredPart};
use crate::commands::{count_trajectories, note_conversions};
use augsim_session::equations::{self, forecast, records};
use augsim_session::predict::fit_percent;
use augsim_session::usage::Inapplicable;
use augsim_terminal::output::Output;
use augsim_terminal::progress::Steps;
use augsim_terminal::{Outcome, Usage};
use serde::Serialize;
use std::fmt::Write;

#[derive(Debug, Serialize)]
struct Score {
    trajectories: usize,
    burn_in: u32,
    /// Whether only the trajectories that the discovery held out of its own data are scored.
    held_out: bool,
    /// Whether the model was fitted to the scored trajectories.
    fitted: bool,
    rows: Vec<forecast::Row>,
}

/// Scores the free run of a model of equations: simulates each trajectory from its estimated initial state.
pub(super) fn run(args: &Evaluate, output: &Output) -> anyhow::Result<Outcome> {
    if args.require_pos_m.is_some() {
        return Err(Usage::Inapplicable(Inapplicable::PositionOfEquations).into());
    }
    let model = equations::read(args.model())?;
    let data = args.measured();
    let measured = records::read(&data, &model)?;
    note_conversions(&data, measured.data.notes(), output);
    let mut list = records::records(&measured.data, &model, false)?;
    let ScoredPart { only, fitted } = ScoredPart::of([OwnData::find(args.model(), &args.data)]);
    let held_out = only.is_some();
    if let Some(only) = only {
        list.retain(|record| only.contains(&record.id));
    }
    let steps = Steps::new(output);
    steps.show_step(format!("simulating {} trajectories", list.len()));
    let burn_in = args.burn_in as usize;
    let unscored = forecast::unscored(&list, burn_in, &data.to_string())?;
    if !unscored.is_empty() {
        output.notice(format!(
            "not scored, because nothing was measured after the first {burn_in} samples: {}",
            unscored.join(", ")
        ));
    }
    let runs = forecast::free_runs(&model, &list, burn_in)?;
    steps.finish();
    let rows = forecast::rows(&model, &runs);
    let score = Score { trajectories: runs.len(), burn_in: args.burn_in, held_out, fitted, rows };
    output.result(&score, || system_score_text(&score))?;
    Ok(Outcome::Done)
}

fn system_score_text(score: &Score) -> String {
    let which = match (score.held_out, score.fitted) {
        (true, _) => " that the discovery kept out of all fits",
        (_, true) => " that the model was fitted to (errors on new data are larger)",
        _ => "",
    };
    let mut text = format!(
        "free run of {}{which}, initial state estimated from the first {} samples",
        count_trajectories(score.trajectories),
        score.burn_in
    );
    for row in &score.rows {
        // Writing to a string cannot fail.
        let _ = write!(text, "\n  {}", errors_text(row));
    }
    text
}

/// Formats the errors of one output of the model as a line.
pub(super) fn errors_text(row: &forecast::Row) -> String {
    if row.samples == 0 {
        return format!("{}: no sample was measured after the first ones, so there is no error", row.output);
    }
    let unit = if row.unit.is_empty() { String::new() } else { format!(" {}", row.unit) };
    let fit = fit_percent(row.r2);
    let mut text = format!("{}: {:.4e}{unit}, fit {fit:.1} %, R2 {:.4}", row.output, row.rmse, row.r2);
    for h in &row.horizons {
        let _ = write!(text, "; to {} s {:.4e}{unit}", h.horizon_s, h.rmse);
    }
    text
}
