//! The three protocols, never mixed.

use crate::in_order;
use crate::score::{Score, Scoring, average, score};
use crate::{Forecaster, NetModel, Samples, Sequence, Sequences, Task, TrainerError};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The part of a trajectory that a row of a table was allowed to see.
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
/// [`TrainerError`] if the model cannot be run, or nothing to score.
pub fn evaluate_forecast(model: &dyn Forecaster, test: &Sequences) -> Result<Score, TrainerError> {
    evaluate(test, |q, index| {
        model.forecast(Task { start: q.state(0), actions: &q.actions, time: q.time, index }, SAMPLES)
    })
}

/// Scores what a net makes of trajectories that its encoder sees. Not a prediction.
///
/// # Errors
/// [`TrainerError`] if the net cannot be run, or nothing to score.
pub fn evaluate_reconstruction(model: &NetModel, test: &Sequences) -> Result<Score, TrainerError> {
    evaluate(test, |q, index| model.reconstruct(q, index, SAMPLES))
}

/// The score of each trajectory of a test set, in its order; [`average`] makes one of them.
///
/// # Errors
/// As [`evaluate_forecast`].
pub fn forecast_scores(model: &dyn Forecaster, test: &Sequences) -> Result<Vec<Score>, TrainerError> {
    each(test, |q, index| {
        model.forecast(Task { start: q.state(0), actions: &q.actions, time: q.time, index }, SAMPLES)
    })
}

fn evaluate(
    test: &Sequences,
    samples: impl Fn(&Sequence, u64) -> Result<Samples, TrainerError> + Sync,
) -> Result<Score, TrainerError> {
    Ok(average(&each(test, samples)?))
}

fn each(
    test: &Sequences,
    samples: impl Fn(&Sequence, u64) -> Result<Samples, TrainerError> + Sync,
) -> Result<Vec<Score>, TrainerError> {
    if test.items.is_empty() {
        return Err(TrainerError::NoTrajectories { what: "the test set" });
    }
    let scoring = Scoring::of(test);
    in_order(test.items.par_iter().enumerate().map(|(i, q)| {
        let samples = samples(q, i as u64)?;
        check_finite(&samples, q)?;
        Ok(score(&samples, &q.states, &scoring))
    }))
}

/// Checks that a forecast of a trajectory consists of finite numbers.
///
/// # Errors
/// [`TrainerError::NotFinite`] names the first step at which it does not.
pub fn check_finite(samples: &Samples, q: &Sequence) -> Result<(), TrainerError> {
    let row = (samples.values.len() / q.time).max(1);
    match samples.values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(at) => {
            Err(TrainerError::NotFinite { id: q.id.clone(), step: at / row, value: samples.values[at] })
        }
    }
}
