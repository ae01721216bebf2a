//! Results of a calibration: values, their errors, starts, and the lengths of windows on the way.

use augsim_physics::system::SimulationError;
use thiserror::Error;

/// One length of windows on the way.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// Median duration of the windows, s.
    pub window_s: f64,
    /// Number of windows.
    pub windows: usize,
    /// Root mean square misfit of each channel, in its unit.
    pub rms: Vec<f64>,
    /// Noise of each channel by that misfit, in its unit: each start state and each parameter has taken a degree of freedom from it.
    pub noise: Vec<f64>,
    /// Steps that were taken.
    pub steps: usize,
    /// Whether the fit came to an end by itself.
    pub converged: bool,
}

/// Parameters of which fewer combinations can be found than there are parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Gauge {
    /// Places of the parameters that can move together without a change of what is measured.
    pub parameters: Vec<usize>,
    /// How many combinations of them can be found.
    pub combinations: usize,
}

/// A calibrated system.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Values of all parameters, in the order of the system's vector.
    pub values: Vec<f64>,
    /// Standard errors of those that were fitted, from the curvature of the cost, wider by the correlation of misfits from
    /// sample to sample.
    pub standard_errors: Vec<Option<f64>>,
    /// Parameters at one of their bounds.
    pub at_bound: Vec<bool>,
    /// Start state of each record and its standard errors, in the order of the schema.
    pub starts: Vec<(Vec<f64>, Vec<f64>)>,
    /// The lengths of windows that were fitted; the last is the one whose values are given.
    pub stages: Vec<Stage>,
    /// Why longer windows were not taken, where they would have been possible.
    pub stopped: Option<&'static str>,
    /// Groups of parameters that cannot be found one by one.
    pub gauges: Vec<Gauge>,
}

impl Calibration {
    /// Root mean square misfit of each channel over the last windows, in its unit.
    pub fn rms(&self) -> &[f64] {
        self.stages.last().map_or(&[], |stage| &stage.rms)
    }
}

/// Records to which nothing can be fitted.
#[derive(Debug, Error)]
pub enum CalibrationError {
    /// No window can be simulated at the declared values.
    #[error("the declared model cannot be simulated: {0}")]
    Simulation(SimulationError),
    /// Nothing was measured.
    #[error("no output has a measured value in the records; check the columns and their ranges")]
    NothingMeasured,
}
