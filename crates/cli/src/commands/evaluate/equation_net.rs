//! `augsim evaluate RUN` for a network on a model of equations: free runs of the network and of the
//! physics alone.

use super::system::errors_text;
use crate::args::{Evaluate, ProtocolArg};
use crate::commands::count_trajectories;
use augsim_discovery::PredictOptions;
use augsim_session::predict::{OutputScores, net_and_physics, scores};
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
    /// Number of random draws of each trajectory.
    samples: usize,
    /// Factors by which the network's corrections are scaled, chosen on held-out recordings; `None` without them.
    #[serde(skip_serializing_if = "Option::is_none")]
    trust: Option<CorrectionShrinkage>,
    /// Scores of the physics model alone, then of the network, one row per output.
    rows: Vec<OutputScores>,
}

#[derive(Debug, Serialize)]
struct CorrectionShrinkage {
    gain: f64,
    spread: f64,
    memory_s: f64,
}

/// Scores free runs of a network on a model of equations, and of the model alone.
pub(super) fn run(args: &Evaluate, model: &NetModel, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    if args.require_pos_m.is_some() {
        return Err(Usage::Inapplicable(Inapplicable::PositionOfEquations).into());
    }
    if args.protocol == ProtocolArg::Reconstruction {
        return Err(Usage::Inapplicable(Inapplicable::ReconstructedEquations).into());
    }
    let Some(engine) = model.state().settings.engine.equation_engine() else {
        return Err(Usage::Inapplicable(Inapplicable::NoEquations).into());
    };
    let options = PredictOptions { seed, draws: SAMPLES, only: None };
    let runs = net_and_physics(model, &args.measured(), args.burn_in as usize, &options)?;
    let mut rows = scores("Physics", engine.equations(), &runs.physics);
    rows.extend(scores(model.name(), engine.equations(), &runs.net));
    let shrinkage = model.shrinkage().map(|t| CorrectionShrinkage {
        gain: t.gain,
        spread: t.spread,
        memory_s: t.correlation_intervals * engine.step_s(),
    });
    let score = Score {
        trajectories: runs.net.len(),
        burn_in: args.burn_in,
        samples: SAMPLES,
        trust: shrinkage,
        rows,
    };
    output.result(&score, || score_text(&score))?;
    Ok(Outcome::Done)
}

fn score_text(score: &Score) -> String {
    let mut text = format!(
        "free runs of {}, initial state estimated from the first {} samples, {} draws each",
        count_trajectories(score.trajectories),
        score.burn_in,
        score.samples
    );
    if let Some(CorrectionShrinkage { gain, spread, memory_s }) = score.trust {
        let correlation =
            if memory_s > 0.0 { format!(" and a correlation time of {memory_s} s") } else { String::new() };
        // Writing to a string cannot fail.
        let _ = match gain > 0.0 {
            true => write!(
                text,
                "\nthe corrections of the net are multiplied by {:.2} and their standard deviations by {spread}{correlation} (chosen on \
                 held-out recordings)",
                gain
            ),
            false => write!(
                text,
                "\nthe corrections of the net did not improve the forecasts of held-out recordings: the mean forecast is that of the \
                 physics, with the standard deviations of the net multiplied by {spread}{correlation}"
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
