//! Resamples trajectories to a constant rate by linear interpolation.

use super::error::PushError;
use super::union_clock::interpolate;
use crate::column::Column;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::limits::Limit;
use crate::trajectory::Trajectory;
use crate::unit::Unit;

/// Suffix of the name of a column that flags measured (not interpolated) samples.
pub(crate) const FRESH_SUFFIX: &str = "_new";

/// Resamples each trajectory at `rate_hz` (Hz) from its first sample on, by linear interpolation.
///
/// Angles are interpolated along the shorter arc. There is no extrapolation, and values next to a gap are
/// gaps. Flags of fresh samples have no meaning at the new times and are left out.
///
/// Signals are not filtered: at a rate far below that of the sensor, noise is aliased.
///
/// # Errors
/// The rate is not positive, or so high that a trajectory or the whole data set exceeds a [`Limit`].
pub fn resample(data: &Dataset, rate_hz: f64) -> Result<Dataset, DataError> {
    if !(rate_hz > 0.0 && rate_hz.is_finite()) {
        return Err(PushError::Rate { rate_hz }.into());
    }
    let kept: Vec<(usize, &Column)> =
        data.columns().iter().enumerate().filter(|(_, c)| !c.name().ends_with(FRESH_SUFFIX)).collect();
    let columns: Vec<Column> = kept.iter().map(|(_, column)| (*column).clone()).collect();
    // The tolerance keeps the last time of a duration of whole intervals in spite of rounding.
    let steps = |t: &Trajectory| {
        let duration = t.time_s()[t.len() - 1] - t.time_s()[0];
        (duration * rate_hz * (1.0 + 4.0 * f64::EPSILON)).floor()
    };
    // Counted in floating point, so that the product cannot overflow.
    let longest = data.trajectories().iter().map(steps).fold(0.0, f64::max);
    let samples: f64 = data.trajectories().iter().map(|t| steps(t) + 1.0).sum();
    Limit::Samples
        .check((longest + 1.0) as u64)
        .and_then(|()| Limit::Cells.check((samples * kept.len() as f64) as u64))
        .map_err(|cause| PushError::RateTooHigh { rate_hz, cause })?;
    let on_grid = |t: &Trajectory| {
        let (clock, last) = (t.time_s(), t.len() - 1);
        let steps = steps(t) as usize;
        let time_s: Vec<f64> =
            (0..=steps).map(|k| (clock[0] + k as f64 / rate_hz).min(clock[last])).collect();
        let values = kept.iter().map(|&(i, column)| {
            let (samples, is_angle) = (t.column(i), column.unit() == Unit::RADIAN);
            time_s.iter().map(|&time| value_at(clock, samples, time, is_angle)).collect()
        });
        t.with_samples(time_s.clone(), values.collect())
    };
    let trajectories = data.trajectories().iter().map(on_grid).collect::<Result<Vec<_>, _>>()?;
    Dataset::with_origin(columns, trajectories, data.origin().clone())
}

/// Value of a column at `time`, s, interpolated between the neighbouring samples.
fn value_at(clock: &[f64], samples: &[f64], time: f64, is_angle: bool) -> f64 {
    let k = clock.partition_point(|&t| t <= time).saturating_sub(1);
    if clock[k] == time || k + 1 == clock.len() {
        return samples[k];
    }
    interpolate(samples[k], samples[k + 1], (time - clock[k]) / (clock[k + 1] - clock[k]), is_angle)
}
