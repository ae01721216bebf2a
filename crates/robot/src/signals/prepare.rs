//! Filtered positions, derivatives and torques on a uniform, decimated clock.

use std::ops::Range;

use super::clock::{interpolate, split_at_gaps, uniform_count};
use super::filter::{LowPass, first_difference, second_difference};
use super::{Log, Preparation, Segment, SignalError};

/// Samples on each side that the central differences need.
const DIFFERENCE_SAMPLES: usize = 2;

/// Prepares a log: one segment for each part without long gaps that is long enough.
///
/// Positions, torques and measured speeds pass the same filter. Derivatives are central differences of order 4 of the filtered
/// positions, before decimation.
///
/// # Errors
/// Wrong shapes, times that do not increase, values that are not finite, or no part that is longer than the trimmed ends.
pub fn prepare(log: &Log, with: &Preparation) -> Result<Vec<Segment>, SignalError> {
    let filter = LowPass::new(with.cutoff_hz, with.interval_s);
    let rows = long_segments(log, with)?;
    Ok(rows.into_iter().map(|rows| prepare_segment(log, rows, with, &filter, margin(with))).collect())
}

/// Prepares a log as [`prepare`] does, but neither trims nor decimates.
///
/// # Errors
/// As [`prepare`].
pub fn prepare_at_full_rate(log: &Log, with: &Preparation) -> Result<Vec<Segment>, SignalError> {
    // The condition on the duration is that of `prepare`, so that both return the same segments.
    let mut segments = Vec::new();
    let filter = LowPass::new(with.cutoff_hz, with.interval_s);
    let full_rate = Preparation { decimation: 1, ..with.clone() };
    for rows in long_segments(log, with)? {
        segments.push(prepare_segment(log, rows, &full_rate, &filter, DIFFERENCE_SAMPLES));
    }
    Ok(segments)
}

/// Filters, trims and decimates values that were computed from a segment at the full rate.
///
/// `values` are `[n][columns]`, and the result is `[k][columns]`.
///
/// A torque that is a nonlinear function of the motion, such as Coulomb friction at the filtered speed, has steps that the
/// filtered measured torque does not have. After this filter it has the same rounded steps. The linear part of the dynamics
/// must not be filtered again: its accelerations have passed the filter already.
///
/// The rows are those of [`prepare_at_full_rate`], and the result has the rows of [`prepare`].
pub fn filter_and_decimate(values: &[Vec<f64>], with: &Preparation) -> Vec<Vec<f64>> {
    let filter = LowPass::new(with.cutoff_hz, with.interval_s);
    let columns = values.first().map_or(0, Vec::len);
    let filtered: Vec<Vec<f64>> =
        (0..columns).map(|k| filter.filter(&values.iter().map(|row| row[k]).collect::<Vec<_>>())).collect();
    let first = margin(with) - DIFFERENCE_SAMPLES;
    let kept = (first..values.len().saturating_sub(first)).step_by(with.decimation);
    kept.map(|i| filtered.iter().map(|column| column[i]).collect()).collect()
}

/// Number of samples of the uniform clock that are dropped at each end of a segment.
fn margin(with: &Preparation) -> usize {
    ((with.trim_s / with.interval_s).ceil() as usize).max(DIFFERENCE_SAMPLES)
}

/// Rows of the segments without long gaps that are longer than their trimmed ends.
fn long_segments(log: &Log, with: &Preparation) -> Result<Vec<Range<usize>>, SignalError> {
    log.check()?;
    if log.time_s.is_empty() {
        return Err(SignalError::TooShort { samples: 0, needed: 1 });
    }
    let margin = margin(with);
    let duration = |rows: &Range<usize>| log.time_s[rows.end - 1] - log.time_s[rows.start];
    let segments = split_at_gaps(&log.time_s, with.max_gap_s);
    let longest_s = segments.iter().map(duration).fold(0.0, f64::max);
    let count = |rows: &Range<usize>| {
        uniform_count(log.time_s[rows.start], log.time_s[rows.end - 1], with.interval_s)
    };
    let long: Vec<Range<usize>> = segments.into_iter().filter(|rows| count(rows) > 2 * margin).collect();
    if long.is_empty() {
        let needed_s = 2.0 * margin as f64 * with.interval_s;
        let (max_gap_s, cutoff_hz) = (with.max_gap_s, with.cutoff_hz);
        return Err(SignalError::SegmentsTooShort { longest_s, needed_s, max_gap_s, cutoff_hz });
    }
    Ok(long)
}

/// Prepares the rows of one segment; the first and last `margin` samples of the uniform clock are dropped.
fn prepare_segment(
    log: &Log,
    rows: Range<usize>,
    with: &Preparation,
    filter: &LowPass,
    margin: usize,
) -> Segment {
    let time = &log.time_s[rows.clone()];
    let count = uniform_count(time[0], time[time.len() - 1], with.interval_s);
    let kept: Vec<usize> = (margin..count - margin).step_by(with.decimation).collect();
    let joints = log.joints.len();
    let filtered = |channel: &[Vec<f64>], joint: usize| {
        let values: Vec<f64> = channel[rows.clone()].iter().map(|row| row[joint]).collect();
        filter.filter(&interpolate(time, &values, with.interval_s))
    };
    let columns =
        |channel: &[Vec<f64>]| (0..joints).map(|joint| filtered(channel, joint)).collect::<Vec<_>>();
    let at_kept = |columns: &[Vec<f64>], value: &dyn Fn(&[f64], usize) -> f64| -> Vec<Vec<f64>> {
        kept.iter().map(|i| columns.iter().map(|column| value(column, *i)).collect()).collect()
    };
    let position = columns(&log.position);
    let sample = |column: &[f64], i: usize| column[i];
    Segment {
        time_s: kept.iter().map(|i| time[0] + *i as f64 * with.interval_s).collect(),
        position: at_kept(&position, &sample),
        speed: at_kept(&position, &|column, i| first_difference(column, i, with.interval_s)),
        acceleration: at_kept(&position, &|column, i| second_difference(column, i, with.interval_s)),
        torque: at_kept(&columns(&log.torque), &sample),
        measured_speed: log.speed.as_ref().map(|speed| at_kept(&columns(speed), &sample)),
    }
}
