//! The state that a record begins with, from its first samples and nothing later.

use crate::outcome::CalibrationError;
use crate::steps::{Begin, SETTLED};
use crate::windows::{Problem, Shot};
use augsim_physics::system::{Record, System};

/// A fitted start.
#[derive(Clone, Debug, PartialEq)]
pub struct Begun {
    /// State at the first sample, in the order of the schema.
    pub state: Vec<f64>,
    /// Root mean square misfit of each channel over the samples that were used, in its unit.
    pub rms: Vec<f64>,
}

/// Fits the start of a record to its first `samples` at these values of the parameters. `from` is a rough state; `sd` is the
/// noise of each channel where it is known, in its unit, against which what is known of a start beforehand is weighed.
///
/// # Errors
/// [`CalibrationError`]: nothing is measured there, or it cannot be simulated.
pub fn fit_start(
    system: &dyn System,
    record: &Record,
    samples: usize,
    values: &[f64],
    from: &[f64],
    sd: &[Option<f64>],
) -> Result<Begun, CalibrationError> {
    let samples = samples.clamp(1, record.times.len());
    if !record.values.iter().flat_map(|v| &v[..samples]).any(|v| v.is_finite()) {
        return Err(CalibrationError::NothingMeasured);
    }
    let records = std::slice::from_ref(record);
    let problem = Problem::new(system, records, false);
    let mut scales = problem.spread();
    let mut shots = vec![Shot { record: 0, samples: 0..samples, start: from.to_vec() }];
    let mut values = values.to_vec();
    // From half of the samples to all of them: a rough speed may lead far away over a long beginning.
    let mut count = samples.min(8);
    loop {
        shots[0].samples.end = count;
        let begin = Begin { values: &values, shots: &shots, sd: &scales };
        let fit = problem.fit_with(&begin, sd, SETTLED).map_err(CalibrationError::Simulation)?;
        (values, shots, scales) = (fit.values, fit.shots, fit.sd);
        if count == samples {
            let rms = fit.normal.rms(problem.schema().channels.len());
            return Ok(Begun { state: shots.remove(0).start, rms });
        }
        count = (2 * count).min(samples);
    }
}
