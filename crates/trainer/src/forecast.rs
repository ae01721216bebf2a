//! The trait of all model classes: forecast trajectories from an initial state and actions.

use crate::TrainerError;

/// A forecast task: all that a predictor may use, i.e. initial state, actions and number of samples.
#[derive(Debug, Clone, Copy)]
pub struct Task<'a> {
    /// Initial state `[S]`, one value per state column, from which the forecast starts.
    pub start: &'a [f64],
    /// Actions `[T, A]` (T samples, A action columns), known in advance; empty for systems without actions.
    pub actions: &'a [f64],
    /// Number of time steps T, the first of which is the initial state.
    pub time: usize,
    /// Index of the trajectory in its set; selects the random stream of the forecast.
    pub index: u64,
}

/// Trajectories sampled from a forecast, `[time, state column, sample]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples {
    /// Number of sampled trajectories.
    pub count: usize,
    /// Sampled states `[time, S, sample]`, in the units of the S state columns.
    pub values: Vec<f32>,
}

/// A model that forecasts trajectories from nothing but its [`Task`].
pub trait Forecaster: Sync {
    /// Name of the model in tables.
    fn name(&self) -> &str;

    /// Whether forecasts from the same task are always identical.
    fn is_deterministic(&self) -> bool {
        false
    }

    /// Draws `samples` trajectories from the forecast of a task (one, if the model is deterministic).
    ///
    /// # Errors
    /// [`TrainerError`] if the model cannot be run.
    fn forecast(&self, task: Task<'_>, samples: usize) -> Result<Samples, TrainerError>;
}
