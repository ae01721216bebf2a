//! Division of a push into windows for fits (by travel of the rod) and segments for forecasts (by time).

use super::path::simplify_path;
use augsim_system::{CORRELATION_STEPS, Record, Window, split_by_duration};
use std::ops::Range;
use std::sync::Arc;

/// Travel of the rod in one fit window, m.
///
/// The effect of a parameter grows with the length of a window, while a disturbance stays confined to the
/// window in which it occurs.
const WINDOW_TRAVEL_M: f64 = 0.05;
/// Tolerance of the simplified rod path, in standard deviations of a measured position.
const PATH_TOLERANCE_SD: f64 = 0.1;
/// Minimum of the path tolerance, m; finer detail is rounding of the log, not motion.
const MIN_PATH_TOLERANCE_M: f64 = 1e-5;
/// Largest travel of the rod, m, at which a push is forecast as a whole.
const MAX_WHOLE_FORECAST_M: f64 = 0.2;
/// Duration of the segments into which the forecast of a longer push is divided, s.
const FORECAST_SEGMENT_S: f64 = 1.0;

/// Divides a push into windows and simplifies its rod path; returns whether the push has enough samples.
///
/// `position_sd_m` is the standard deviation of a measured position.
pub(super) fn split(record: &mut Record, position_sd_m: f64) -> bool {
    let Some(rod) = Arc::make_mut(&mut record.inputs).first_mut() else { return false };
    let [x, y] = &rod.values[..] else { return false };
    if record.times.len() < 2 || rod.times.len() < 2 {
        return false;
    }
    let travel = travel(&rod.times, x, y, &record.times);
    let tolerance = (PATH_TOLERANCE_SD * position_sd_m).max(MIN_PATH_TOLERANCE_M);
    let corners = simplify_path(&rod.times, x, y, tolerance);
    let at_corners = |values: &[f64]| corners.iter().map(|&k| values[k]).collect::<Vec<_>>();
    rod.values = rod.values.iter().map(|values| at_corners(values)).collect();
    rod.times = at_corners(&rod.times);
    record.windows = windows_by_travel(&travel)
        .into_iter()
        .map(|samples| Window { start: first_pose(record, samples.start), samples })
        .collect();
    let is_forecast_whole = travel.last().is_none_or(|length| *length <= MAX_WHOLE_FORECAST_M);
    record.forecasts =
        if is_forecast_whole { Vec::new() } else { split_by_duration(&record.times, FORECAST_SEGMENT_S) };
    record.noise_correlation_s = CORRELATION_STEPS * record.typical_step();
    record.initial_sample_count = 1;
    !record.windows.is_empty()
}

/// First finite value of each channel from sample `first` on; 0 for a channel without one.
fn first_pose(record: &Record, first: usize) -> Vec<f64> {
    let measured = |values: &Vec<f64>| values[first..].iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    record.values.iter().map(measured).collect()
}

/// Travel of the rod from its first position up to each of `times`, m.
fn travel(rod_times: &[f64], x: &[f64], y: &[f64], times: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut cumulative = vec![0.0];
    for k in 1..rod_times.len() {
        sum += (x[k] - x[k - 1]).hypot(y[k] - y[k - 1]);
        cumulative.push(sum);
    }
    times
        .iter()
        .map(|&t| cumulative[rod_times.partition_point(|&r| r <= t).clamp(1, cumulative.len()) - 1])
        .collect()
}

/// Sample ranges of the fit windows, in each of which the rod travels [`WINDOW_TRAVEL_M`].
fn windows_by_travel(travel: &[f64]) -> Vec<Range<usize>> {
    let mut windows: Vec<Range<usize>> = Vec::new();
    let mut first = 0;
    for k in 0..travel.len() {
        if k + 1 == travel.len() || travel[k] - travel[first] >= WINDOW_TRAVEL_M {
            windows.push(first..k + 1);
            first = k + 1;
        }
    }
    // A last window that is too short to be informative is merged with the one before it.
    if let [.., before, last] = &mut windows[..]
        && (travel[last.end - 1] - travel[last.start] < 0.5 * WINDOW_TRAVEL_M || last.len() < 4)
    {
        before.end = last.end;
        windows.pop();
    }
    windows.retain(|w| w.len() > 1);
    windows
}
