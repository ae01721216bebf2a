//! Filtered positions, derivatives and torques on uniform, decimated clocks.

use std::ops::Range;

use super::clock::{interpolate, split_at_gaps, uniform_count};
use super::filter::{LowPass, first_difference, second_difference};
use super::low_pass::LowPassResponse;
use super::{Log, Preparation, Segment, SignalError};

/// Samples on each side that the central differences need.
const DIFFERENCE_SAMPLES: usize = 2;

/// Prepares a log: one segment for each part without long gaps that is long enough.
///
/// Positions and torques pass the first filter, and the torques then the second. Derivatives are central differences of order 4
/// of the filtered positions, before decimation.
///
/// # Errors
/// Wrong shapes, times that do not increase, values that are not finite, or no part that is longer than the trimmed ends.
pub fn prepare(log: &Log, with: &Preparation) -> Result<Vec<Segment>, SignalError> {
    let filter = LowPass::new(with.motion_cutoff_hz, with.interval_s);
    let weights = LowPassResponse::new(with.cutoff_hz).weights(with.interval_s);
    let rows = long_segments(log, with)?;
    Ok(rows.into_iter().map(|rows| prepare_segment(log, rows, with, &filter, &weights)).collect())
}

/// Number of samples of the uniform clock that are dropped at each end of the motion of a segment.
fn motion_margin(with: &Preparation) -> usize {
    ((with.motion_trim_s / with.interval_s).ceil() as usize).max(DIFFERENCE_SAMPLES)
}

/// Number of samples of the uniform clock that are dropped at each end of the torques of a segment.
fn torque_margin(with: &Preparation) -> usize {
    let reach = (with.trim_s / with.interval_s).ceil() as usize;
    // The torques are sampled where the motion is.
    motion_margin(with) + reach.next_multiple_of(with.motion_decimation)
}

/// Rows of the segments without long gaps that are longer than their trimmed ends.
fn long_segments(log: &Log, with: &Preparation) -> Result<Vec<Range<usize>>, SignalError> {
    log.check()?;
    if log.time_s.is_empty() {
        return Err(SignalError::TooShort { samples: 0, needed: 1 });
    }
    let margin = torque_margin(with);
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

/// Prepares the rows of one segment; `weights` are those of the second filter.
fn prepare_segment(
    log: &Log,
    rows: Range<usize>,
    with: &Preparation,
    filter: &LowPass,
    weights: &[f64],
) -> Segment {
    let time = &log.time_s[rows.clone()];
    let count = uniform_count(time[0], time[time.len() - 1], with.interval_s);
    let (first, first_torque) = (motion_margin(with), torque_margin(with));
    let motion_rows: Vec<usize> = (first..count - first).step_by(with.motion_decimation).collect();
    let torques: Vec<usize> = (first_torque..count - first_torque).step_by(with.decimation).collect();
    let filtered = |channel: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let column = |joint: usize| {
            let values: Vec<f64> = channel[rows.clone()].iter().map(|row| row[joint]).collect();
            filter.filter(&interpolate(time, &values, with.interval_s))
        };
        (0..log.joints.len()).map(column).collect()
    };
    let at = |rows: &[usize], columns: &[Vec<f64>], value: &dyn Fn(&[f64], usize) -> f64| -> Vec<Vec<f64>> {
        rows.iter().map(|i| columns.iter().map(|column| value(column, *i)).collect()).collect()
    };
    let position = filtered(&log.position);
    let reach = weights.len() / 2;
    let low_passed = |column: &[f64], i: usize| -> f64 {
        weights.iter().zip(&column[i - reach..]).map(|(weight, value)| weight * value).sum()
    };
    let interval_s = with.interval_s;
    Segment {
        time_s: motion_rows.iter().map(|i| time[0] + *i as f64 * interval_s).collect(),
        position: at(&motion_rows, &position, &|column, i| column[i]),
        speed: at(&motion_rows, &position, &|column, i| first_difference(column, i, interval_s)),
        acceleration: at(&motion_rows, &position, &|column, i| second_difference(column, i, interval_s)),
        torque_rows: torques.iter().map(|i| (i - first) / with.motion_decimation).collect(),
        torque: at(&torques, &filtered(&log.torque), &low_passed),
    }
}
