//! One trait for every model class: given s_0 and actions, give trajectories.

use crate::TrainerError;

/// Everything that a predictor may see: the first state, the actions, and how far to go.
#[derive(Debug, Clone, Copy)]
pub struct Task<'a> {
    /// First state, `[S]`.
    pub start: &'a [f64],
    /// Actions `[T, A]`, known beforehand; empty where nobody acts.
    pub actions: &'a [f64],
    /// Number of samples T, the first of which is the start.
    pub time: usize,
    /// Place of the trajectory in its set: decides the random stream.
    pub index: u64,
}

/// Sampled trajectories `[time, S, sample]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples {
    /// Number of samples.
    pub count: usize,
    /// Values.
    pub values: Vec<f32>,
}

/// A model that forecasts. It never sees more than its [`Task`].
pub trait Forecaster: Sync {
    /// Name in tables.
    fn name(&self) -> &str;

    /// Whether every forecast from the same start is the same.
    fn is_deterministic(&self) -> bool {
        false
    }

    /// `samples` trajectories (one, if the model is deterministic).
    ///
    /// # Errors
    /// [`TrainerError`] if the model cannot be run.
    fn forecast(&self, task: Task<'_>, samples: usize) -> Result<Samples, TrainerError>;
}
