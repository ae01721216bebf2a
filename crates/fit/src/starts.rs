//! Estimation of the initial state of a record from its first samples only.

use crate::outcome::CalibrationError;
use crate::steps::{FINAL_TOLERANCE, StartingPoint};
use crate::windows::{Problem, ShootingWindow};
use augsim_system::{Record, Simulate};

/// Number of samples in the first of the fits over successively longer beginnings of a record.
const FIRST_FIT_SAMPLES: usize = 8;

/// Initial state of a record, estimated from its first samples.
#[derive(Clone, Debug, PartialEq)]
pub struct InitialStateEstimate {
    /// Estimated state at the first sample of the record, in the order of the schema's states.
    pub state: Vec<f64>,
    /// RMSE of each channel over the samples used for the estimate, in its unit.
    pub rmse: Vec<f64>,
}

/// Estimates the initial state of a record from its first `samples` samples, at fixed parameter values.
///
/// `from` is a rough initial state. `sd` is the measurement noise of each channel, in its unit, or `None`
/// where it is unknown; it sets the weight of the data against the priors of the initial state.
///
/// # Errors
/// [`CalibrationError`]: no output is measured in these samples, or they cannot be simulated.
pub fn estimate_initial_state(
    system: &dyn Simulate,
    record: &Record,
    samples: usize,
    values: &[f64],
    from: &[f64],
    sd: &[Option<f64>],
) -> Result<InitialStateEstimate, CalibrationError> {
    let samples = samples.clamp(1, record.times.len());
    if !record.values.iter().flat_map(|v| &v[..samples]).any(|v| v.is_finite()) {
        return Err(CalibrationError::NothingMeasured);
    }
    let records = std::slice::from_ref(record);
    let problem = Problem::new(system, records, false);
    let mut scales = problem.channel_sd();
    let mut windows = vec![ShootingWindow { record: 0, samples: 0..samples, initial_state: from.to_vec() }];
    let mut values = values.to_vec();
    // The fits double in length: with a rough initial velocity a long simulation would leave the data at
    // once, and the fit would end in a wrong minimum.
    let mut count = samples.min(FIRST_FIT_SAMPLES);
    loop {
        windows[0].samples.end = count;
        let start = StartingPoint { values: &values, windows: &windows, scales: &scales };
        let fit = problem
            .fit_with_known_scales(&start, sd, FINAL_TOLERANCE)
            .map_err(CalibrationError::Simulation)?;
        (values, windows, scales) = (fit.values, fit.windows, fit.scales);
        if count == samples {
            let rms = fit.normal.rmse(problem.schema().channels.len());
            return Ok(InitialStateEstimate { state: windows.remove(0).initial_state, rmse: rms });
        }
        count = (2 * count).min(samples);
    }
}
