//! Error measures of the published bouncing-ball table, used by [`floor`](super::floor).
//!
//! Position and velocity: mean absolute error over all samples (including the initial state) and
//! trajectories. Trans %: mean over trajectories of sum |height error| / sum |height|, so that predicting 0
//! scores 100 %.

use augsim_data::{DataError, Dataset};
use serde::Serialize;
use thiserror::Error;

/// Reason why a prediction cannot be scored.
#[derive(Debug, Error)]
pub enum ScoreError {
    /// A required column is missing, or the data are invalid.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A scored trajectory has missing samples.
    #[error("trajectory `{trajectory}`: has gaps; score trajectories without missing cells")]
    Gap {
        /// Name of the trajectory with missing samples.
        trajectory: String,
    },
    /// All heights of a trajectory are 0, so that its relative error is undefined.
    #[error(
        "trajectory `{trajectory}`: every height is 0, so the relative error is undefined; remove the trajectory"
    )]
    NoHeight {
        /// Name of the trajectory whose heights are all 0.
        trajectory: String,
    },
    /// The data set has no trajectories.
    #[error("no trajectories to score; pass at least one")]
    Nothing,
    /// The ensemble has fewer than two draws, or fewer than are averaged.
    #[error("{draws} draws are too few; use at least {needed}")]
    TooFewDraws {
        /// Number of draws that was requested.
        draws: usize,
        /// Smallest possible number of draws.
        needed: usize,
    },
    /// The samples of a trajectory are not at the engine's time steps.
    #[error(
        "trajectory `{trajectory}`: sample {sample} is not {sample} steps of {step_s} s after \
         the first; this engine has a fixed step: resample the data"
    )]
    OtherRate {
        /// Name of the trajectory with other sample times.
        trajectory: String,
        /// Index of the first sample that is not at a time step.
        sample: usize,
        /// Time step of the engine, s.
        step_s: f64,
    },
}

/// Mean of a quantity over trajectories, with its standard error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// Mean of the quantity over the trajectories.
    pub mean: f64,
    /// Standard error: standard deviation over trajectories / sqrt(trajectories); 0 for a single one.
    pub standard_error: f64,
}

impl Estimate {
    /// Mean and standard error of `values`, one per trajectory.
    pub fn from_values(values: impl Iterator<Item = f64> + Clone) -> Estimate {
        let count = values.clone().count() as f64;
        let mean = values.clone().sum::<f64>() / count;
        let squares: f64 = values.map(|v| (v - mean).powi(2)).sum();
        let standard_error = if count > 1.0 { (squares / (count - 1.0) / count).sqrt() } else { 0.0 };
        Estimate { mean, standard_error }
    }
}

/// Mean errors of a predictor on a data set: height, velocity and trans %.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BallScore {
    /// Absolute height error, mean over samples and trajectories, m.
    pub position_m: Estimate,
    /// Absolute velocity error, mean over samples and trajectories, m/s.
    pub velocity_m_s: Estimate,
    /// Relative height error (trans %), mean over the trajectories, %.
    pub trans_percent: Estimate,
}

impl BallScore {
    /// Averages the errors of single trajectories.
    pub(crate) fn from_errors(errors: &[TrajectoryError]) -> BallScore {
        BallScore {
            position_m: Estimate::from_values(errors.iter().map(|e| e.position_m)),
            velocity_m_s: Estimate::from_values(errors.iter().map(|e| e.velocity_m_s)),
            trans_percent: Estimate::from_values(errors.iter().map(|e| e.trans_percent)),
        }
    }
}

/// Errors of one trajectory; units as in [`BallScore`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TrajectoryError {
    pub(crate) position_m: f64,
    pub(crate) velocity_m_s: f64,
    pub(crate) trans_percent: f64,
}

/// The true heights and velocities of one trajectory.
pub(crate) struct Observation<'a> {
    pub(crate) height_m: &'a [f64],
    pub(crate) velocity_m_s: &'a [f64],
    height_sum: f64,
}

impl Observation<'_> {
    /// Mean errors of the trajectory, from sums of absolute errors over its samples.
    pub(crate) fn error_from_sums(&self, height: f64, velocity: f64) -> TrajectoryError {
        let samples = self.height_m.len() as f64;
        TrajectoryError {
            position_m: height / samples,
            velocity_m_s: velocity / samples,
            trans_percent: 100.0 * height / self.height_sum,
        }
    }
}

/// True heights and velocities of each trajectory; an error if one has gaps or heights that are all 0.
pub(crate) fn observations(truth: &Dataset) -> Result<Vec<Observation<'_>>, ScoreError> {
    let (height, velocity) = (truth.column_index("height_m")?, truth.column_index("velocity_m_s")?);
    if truth.trajectories().is_empty() {
        return Err(ScoreError::Nothing);
    }
    let observe = |t| {
        let t: &augsim_data::Trajectory = t;
        let (height_m, velocity_m_s) = (t.column(height), t.column(velocity));
        let trajectory = || t.id().to_owned();
        if height_m.iter().chain(velocity_m_s).any(|v| v.is_nan()) {
            return Err(ScoreError::Gap { trajectory: trajectory() });
        }
        let height_sum: f64 = height_m.iter().map(|h| h.abs()).sum();
        if height_sum == 0.0 {
            return Err(ScoreError::NoHeight { trajectory: trajectory() });
        }
        Ok(Observation { height_m, velocity_m_s, height_sum })
    };
    truth.trajectories().iter().map(observe).collect()
}
