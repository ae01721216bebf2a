//! Results of a calibration: parameter values, standard errors, initial states, window lengths.

use augsim_system::SimulationError;
use thiserror::Error;

/// Summary of the fit over windows of one length.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// Median duration of the windows, s.
    pub window_s: f64,
    /// Number of fitted windows.
    pub windows: usize,
    /// RMSE of the predictions in each channel, in its unit.
    pub rmse: Vec<f64>,
    /// Residual standard deviation of each channel, in its unit.
    ///
    /// It exceeds the RMSE, because every estimated parameter and initial state uses up one degree of
    /// freedom.
    pub noise: Vec<f64>,
    /// Number of optimisation steps, accepted or rejected.
    pub steps: usize,
    /// Whether the fit converged before it reached the maximum number of steps.
    pub converged: bool,
}

/// A structural non-identifiability: parameters of which the data determine only some combinations.
#[derive(Clone, Debug, PartialEq)]
pub struct Gauge {
    /// Indices of the parameters that can change together without a change of the outputs.
    pub parameters: Vec<usize>,
    /// Number of independent combinations of these parameters that the data determine.
    pub combinations: usize,
}

/// Result of a calibration: parameter values, uncertainties and initial states of the fitted system.
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
    /// For each parameter: whether it is estimated and lies at one of its bounds.
    pub at_bound: Vec<bool>,
    /// Initial state of each record and the standard errors of its components, in the order of the schema's
    /// states.
    pub initial_states: Vec<(Vec<f64>, Vec<f64>)>,
    /// Fits over increasing window lengths, shortest first; the parameter values come from the last one.
    pub stages: Vec<Stage>,
    /// Reason why longer windows were not used; `None` if the records or the caller allow no longer ones.
    pub stopped: Option<&'static str>,
    /// Groups of parameters of which the data determine only combinations (gauges).
    pub gauges: Vec<Gauge>,
    /// Values of the parameters that have one value per group of records; their entry in `values` is the mean.
    pub groups: Vec<GroupCalibration>,
}

/// Calibrated values of a parameter with one value per group of records.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupCalibration {
    /// Index of the parameter.
    pub parameter: usize,
    /// Value of the parameter for each group.
    pub values: Vec<f64>,
    /// Standard error of each value; `None` for a frozen value and for a group without records.
    pub standard_errors: Vec<Option<f64>>,
}

impl Calibration {
    /// RMSE of each channel over the longest windows that were fitted, in its unit.
    pub fn rmse(&self) -> &[f64] {
        self.stages.last().map_or(&[], |stage| &stage.rmse)
    }
}

/// Reasons why a system cannot be calibrated on records.
#[derive(Debug, Error)]
pub enum CalibrationError {
    /// A window cannot be simulated at the declared parameter values; contains the simulation error.
    #[error("the declared model cannot be simulated: {0}")]
    Simulation(SimulationError),
    /// No output has a measured value in any record.
    #[error("no output has a measured value in the records; check the columns and their ranges")]
    NothingMeasured,
}
