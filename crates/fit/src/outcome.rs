//! Results of a calibration: parameter values, standard errors, initial states, window lengths.

use augsim_system::SimulationError;
use thiserror::Error;

/// The fit over windows of one length.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// Median duration of the windows, s.
    pub window_s: f64,
    /// Number of windows.
    pub windows: usize,
    /// RMSE of each channel, in its unit.
    pub rmse: Vec<f64>,
    /// Residual standard deviation of each channel, in its unit.
    ///
    /// It exceeds the RMSE, because every estimated parameter and initial state uses up one degree of
    /// freedom.
    pub noise: Vec<f64>,
    /// Number of steps, accepted or rejected.
    pub steps: usize,
    /// Whether the fit converged before it ran out of steps.
    pub converged: bool,
}

/// A structural non-identifiability: parameters of which the data determine only some combinations.
#[derive(Clone, Debug, PartialEq)]
pub struct Gauge {
    /// Indices of the parameters that can change together without a change of the outputs.
    pub parameters: Vec<usize>,
    /// Number of their combinations that the data determine.
    pub combinations: usize,
}

/// A calibrated system.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Values of all parameters, in the order of the system's parameter vector.
    pub values: Vec<f64>,
    /// Standard errors of the estimated parameters, `None` for frozen ones.
    ///
    /// They come from the curvature of the cost and are widened for the correlation of successive residuals.
    pub standard_errors: Vec<Option<f64>>,
    /// Covariance of the estimated parameters, `[parameter][parameter]` in the order of all parameters, with rows
    /// and columns of 0 for frozen ones.
    pub covariance: Vec<Vec<f64>>,
    /// Whether each parameter is estimated and lies at one of its bounds.
    pub at_bound: Vec<bool>,
    /// Initial state of each record and its standard errors, in the order of the schema.
    pub initial_states: Vec<(Vec<f64>, Vec<f64>)>,
    /// The window lengths that were fitted, shortest first; the parameter values are those of the last.
    pub stages: Vec<Stage>,
    /// Why longer windows were not used although the records are long enough for them.
    pub stopped: Option<&'static str>,
    /// Groups of parameters that are not identifiable one by one.
    pub gauges: Vec<Gauge>,
}

impl Calibration {
    /// RMSE of each channel over the final windows, in its unit.
    pub fn rmse(&self) -> &[f64] {
        self.stages.last().map_or(&[], |stage| &stage.rmse)
    }
}

/// Reasons why records cannot be calibrated.
#[derive(Debug, Error)]
pub enum CalibrationError {
    /// A window cannot be simulated at the declared parameter values.
    #[error("the declared model cannot be simulated: {0}")]
    Simulation(SimulationError),
    /// No output has a measured value.
    #[error("no output has a measured value in the records; check the columns and their ranges")]
    NothingMeasured,
}
