//! `augsim evaluate RUN` for a net on what the equations of a system leave: free runs of the net and of the physics alone.

use super::system::errors_text;
use crate::args::{Evaluate, ProtocolArg};
use augsim_discovery::ForetellOptions;
use augsim_session::DataFrom;
use augsim_session::foretell::{ScoredRow, beside, scored};
use augsim_session::usage::Inapplicable;
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};
use augsim_trainer::{Forecaster, NetModel, SAMPLES};
use serde::Serialize;
use std::fmt::Write;

#[derive(Debug, Serialize)]
struct Score {
    trajectories: usize,
    burn_in: u32,
    /// Draws of each trajectory.
    samples: usize,
    /// Share of the net's mean corrections, and factor of its deviations, that records held out of its training allow.
    #[serde(skip_serializing_if = "Option::is_none")]
    trust: Option<Trust>,
    /// The physics alone, then the net, output by output.
    rows: Vec<ScoredRow>,
}

#[derive(Debug, Serialize)]
struct Trust {
    gain: f64,
    spread: f64,
    memory_s: f64,
}

/// Scores a net.
pub(super) fn run(args: &Evaluate, model: &NetModel, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    if args.require_pos_m.is_some() {
        return Err(Usage::Inapplicable(Inapplicable::PositionOfEquations).into());
    }
    if args.protocol == ProtocolArg::Reconstruction {
        return Err(Usage::Inapplicable(Inapplicable::ReconstructedEquations).into());
    }
    let Some(engine) = model.state().settings.engine.written() else {
        return Err(Usage::Inapplicable(Inapplicable::NoEquations).into());
    };
    let options = ForetellOptions { seed, draws: SAMPLES, only: None };
    let found = beside(model, &DataFrom::from(&args.data), args.burn_in as usize, &options)?;
    let mut rows = scored("Physics", engine.equations(), &found.physics);
    rows.extend(scored(model.name(), engine.equations(), &found.net));
    let trust =
        model.trust().map(|t| Trust { gain: t.gain, spread: t.spread, memory_s: t.memory * engine.step_s() });
    let score = Score { trajectories: found.net.len(), burn_in: args.burn_in, samples: SAMPLES, trust, rows };
    output.result(&score, || score_text(&score))?;
    Ok(Outcome::Done)
}

fn score_text(score: &Score) -> String {
    let many = if score.trajectories == 1 { "trajectory" } else { "trajectories" };
    let mut text = format!(
        "free runs of {} {many}, start from the first {} samples, {} draws each",
        score.trajectories, score.burn_in, score.samples
    );
    if let Some(Trust { gain, spread, memory_s }) = score.trust {
        let wander = if memory_s > 0.0 { format!(" and wandering over {memory_s} s") } else { String::new() };
        // Writing to a string cannot fail.
        let _ = match gain > 0.0 {
            true => write!(
                text,
                "\nof the net's corrections {:.0} % are taken, their deviations times {spread}{wander}, as records held out of its training \
                 allow",
                100.0 * gain
            ),
            false => write!(
                text,
                "\nthe net's corrections made no forecast better on records held out of its training: the physics alone goes on, with \
                 deviations times {spread}{wander}"
            ),
        };
    }
    for row in &score.rows {
        let unit = if row.row.unit.is_empty() { String::new() } else { format!(" {}", row.row.unit) };
        let _ = write!(
            text,
            "\n  {} {}; CRPS {:.4e}{unit}, {:.1} % in the 50 % band, {:.1} % in the 90 % band",
            row.model,
            errors_text(&row.row),
            row.crps,
            100.0 * row.coverage50,
            100.0 * row.coverage90
        );
    }
    text
}
