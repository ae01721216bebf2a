//! Filtered positions, derivatives and torques on a uniform, decimated clock.

use std::ops::Range;

use super::clock::{interpolate, split_at_gaps, uniform_count};
use super::filter::{LowPass, first_difference, second_difference};
use super::{Log, Preparation, Segment, SignalError};

/// Prepares a log: one segment for each part without long gaps that is long enough.
///
/// Positions, torques and measured speeds pass the same filter. Derivatives are central differences of order 4 of the filtered
/// positions, before decimation.
///
/// # Errors
/// Wrong shapes, times that do not increase, values that are not finite, or no part that is longer than the trimmed ends.
pub fn prepare(log: &Log, with: &Preparation) -> Result<Vec<Segment>, SignalError> {
    log.check()?;
    if log.time_s.is_empty() {
        return Err(SignalError::TooShort { samples: 0, needed: 1 });
    }
    // The differences need two samples on each side.
    let margin = ((with.trim_s / with.interval_s).ceil() as usize).max(2);
    let filter = LowPass::new(with.cutoff_hz, with.interval_s);
    let duration = |rows: &Range<usize>| log.time_s[rows.end - 1] - log.time_s[rows.start];
    let rows = split_at_gaps(&log.time_s, with.max_gap_s);
    let long_enough = |rows: &&Range<usize>| {
        uniform_count(log.time_s[rows.start], log.time_s[rows.end - 1], with.interval_s) > 2 * margin
    };
    let segments: Vec<Segment> = rows
        .iter()
        .filter(long_enough)
        .map(|rows| prepare_segment(log, rows.clone(), with, &filter, margin))
        .collect();
    if segments.is_empty() {
        return Err(SignalError::SegmentsTooShort {
            longest_s: rows.iter().map(duration).fold(0.0, f64::max),
            needed_s: 2.0 * margin as f64 * with.interval_s,
            max_gap_s: with.max_gap_s,
            cutoff_hz: with.cutoff_hz,
        });
    }
    Ok(segments)
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
