//! The three protocols, never mixed.

use crate::score::{Score, average, score};
use crate::{Forecaster, NetModel, Sequences, Task, TrainerError};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What a row of a table was allowed to see.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Protocol {
    /// Samples of the prior; the model sees the first state only.
    Forecast,
    /// The encoder sees the whole trajectory: not a prediction.
    Reconstruction,
    /// The best that any predictor can do from the first state, from the known law of the data.
    Floor,
}

impl Protocol {
    /// Name in tables.
    pub fn label(self) -> &'static str {
        match self {
            Protocol::Forecast => "forecast",
            Protocol::Reconstruction => "reconstruction",
            Protocol::Floor => "floor",
        }
    }
}

/// Samples drawn per trajectory for medians, bands and scores.
pub const SAMPLES: usize = 100;

/// Scores the forecasts of `model` on a test set.
///
/// # Errors
/// [`TrainerError`] if the model cannot be run.
pub fn evaluate_forecast(model: &dyn Forecaster, test: &Sequences) -> Result<Score, TrainerError> {
    let s = test.state_dim();
    let scores = test
        .items
        .par_iter()
        .enumerate()
        .map(|(i, q)| {
            let task = Task { start: q.state(0), actions: &q.actions, time: q.time, index: i as u64 };
            Ok(score(&model.forecast(task, SAMPLES)?, &q.states, s))
        })
        .collect::<Result<Vec<_>, TrainerError>>()?;
    Ok(average(&scores))
}

/// Scores what a net makes of trajectories that its encoder sees. Not a prediction.
///
/// # Errors
/// [`TrainerError`] if the net cannot be run.
pub fn evaluate_reconstruction(model: &NetModel, test: &Sequences) -> Result<Score, TrainerError> {
    let s = test.state_dim();
    let scores = test
        .items
        .par_iter()
        .enumerate()
        .map(|(i, q)| Ok(score(&model.reconstruct(q, i as u64, SAMPLES)?, &q.states, s)))
        .collect::<Result<Vec<_>, TrainerError>>()?;
    Ok(average(&scores))
}
