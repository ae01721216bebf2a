//! Evaluation on a test set under one of three protocols, whose scores are never compared.

use crate::collect_in_order;
use crate::score::{Score, Scoring, average, score};
use crate::{Forecaster, NetModel, Samples, Sequence, Sequences, Task, TrainerError};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Evaluation protocol: which part of a test trajectory the model may observe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Protocol {
    /// The model observes the first state only and samples from its prior: a prediction.
    Forecast,
    /// The encoder observes the whole trajectory: not a prediction.
    Reconstruction,
    /// Best score that any predictor can reach from the first state, computed with the true data distribution.
    Floor,
}

impl Protocol {
    /// Name of the evaluation protocol in tables.
    pub fn label(self) -> &'static str {
        match self {
            Protocol::Forecast => "forecast",
            Protocol::Reconstruction => "reconstruction",
            Protocol::Floor => "floor",
        }
    }
}

/// Number of samples drawn per trajectory for medians, prediction bands and scores.
pub const SAMPLES: usize = 100;

/// Scores the forecasts of `model` on a test set.
///
/// # Errors
/// [`TrainerError`] if the model cannot be run, a forecast is not finite, or the test set is empty.
pub fn evaluate_forecast(model: &dyn Forecaster, test: &Sequences) -> Result<Score, TrainerError> {
    Ok(average(&forecast_scores(model, test)?))
}

/// Scores the reconstructions of a net, whose encoder observes each whole test trajectory.
/// A reconstruction is not a prediction.
///
/// # Errors
/// [`TrainerError`] if the net cannot be run, a value is not finite, or the test set is empty.
pub fn evaluate_reconstruction(model: &NetModel, test: &Sequences) -> Result<Score, TrainerError> {
    Ok(average(&score_each(test, |q, index| model.reconstruct(q, index, SAMPLES))?))
}

/// Scores the forecast of each test trajectory, in the order of the set; [`average`] combines them.
///
/// # Errors
/// As [`evaluate_forecast`].
pub fn forecast_scores(model: &dyn Forecaster, test: &Sequences) -> Result<Vec<Score>, TrainerError> {
    score_each(test, |q, index| {
        model.forecast(Task { start: q.state(0), actions: &q.actions, time: q.time, index }, SAMPLES)
    })
}

fn score_each(
    test: &Sequences,
    samples: impl Fn(&Sequence, u64) -> Result<Samples, TrainerError> + Sync,
) -> Result<Vec<Score>, TrainerError> {
    if test.items.is_empty() {
        return Err(TrainerError::NoTrajectories { what: "the test set" });
    }
    let scoring = Scoring::for_columns(test);
    collect_in_order(test.items.par_iter().enumerate().map(|(i, q)| {
        let samples = samples(q, i as u64)?;
        check_finite(&samples, q)?;
        Ok(score(&samples, &q.states, &scoring))
    }))
}

/// Checks that all values of a forecast are finite.
///
/// # Errors
/// [`TrainerError::NotFinite`], with the first step that has a value which is not finite.
pub fn check_finite(samples: &Samples, q: &Sequence) -> Result<(), TrainerError> {
    let row_len = (samples.values.len() / q.time).max(1);
    match samples.values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(position) => {
            let (step, value) = (position / row_len, samples.values[position]);
            Err(TrainerError::NotFinite { id: q.id.clone(), step, value })
        }
    }
}
