//! Pieces of a push: windows of fits by the travel of the rod, pieces of forecasts by time.

use super::path::enough;
use crate::system::{MEMORY, Record, Window, pieces_of};
use std::ops::Range;
use std::sync::Arc;

/// Travel of the rod in one window of a fit, m: the deviations of one effect grow with it, those of knocks stay apart.
const WINDOW_TRAVEL_M: f64 = 0.05;
/// How closely the path that is simulated follows the recorded one, in units of the noise of a position, and at least, m:
/// the rounding of a log is no motion, and fits integrate no finer.
const PATH: f64 = 0.1;
const PATH_M: f64 = 1e-5;
/// Longest push that is forecast as a whole, m of travel; longer ones are cut into pieces of so many seconds.
const WHOLE_M: f64 = 0.2;
const FORECAST_S: f64 = 1.0;

/// Cuts a push into windows, and its rod's path down to the corners that are enough. `position_sd_m` is the noise of a
/// position. Whether the push has poses and rod positions enough to say anything.
pub(super) fn cut(record: &mut Record, position_sd_m: f64) -> bool {
    let Some(rod) = Arc::make_mut(&mut record.inputs).first_mut() else { return false };
    let [x, y] = &rod.values[..] else { return false };
    if record.times.len() < 2 || rod.times.len() < 2 {
        return false;
    }
    let travel = travel(&rod.times, x, y, &record.times);
    let tolerance = (PATH * position_sd_m).max(PATH_M);
    let corners = enough(&rod.times, x, y, tolerance);
    let at = |values: &[f64]| corners.iter().map(|&k| values[k]).collect::<Vec<_>>();
    rod.values = rod.values.iter().map(|values| at(values)).collect();
    rod.times = at(&rod.times);
    record.windows = by_travel(&travel)
        .into_iter()
        .map(|samples| Window { start: pose(record, samples.start), samples })
        .collect();
    let whole = travel.last().is_none_or(|length| *length <= WHOLE_M);
    record.forecasts = if whole { Vec::new() } else { pieces_of(&record.times, FORECAST_S) };
    record.memory_s = MEMORY * record.typical_step();
    record.known = 1;
    !record.windows.is_empty()
}

/// The first measured value of each channel from sample `first` on.
fn pose(record: &Record, first: usize) -> Vec<f64> {
    let measured = |values: &Vec<f64>| values[first..].iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    record.values.iter().map(measured).collect()
}

/// Travel of the rod until each of `times`, m.
fn travel(rod_times: &[f64], x: &[f64], y: &[f64], times: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut at = vec![0.0];
    for k in 1..rod_times.len() {
        sum += (x[k] - x[k - 1]).hypot(y[k] - y[k - 1]);
        at.push(sum);
    }
    times.iter().map(|&t| at[rod_times.partition_point(|&r| r <= t).clamp(1, at.len()) - 1]).collect()
}

/// Ranges of samples in which the rod travels so far as a window has it.
fn by_travel(travel: &[f64]) -> Vec<Range<usize>> {
    let mut windows: Vec<Range<usize>> = Vec::new();
    let mut first = 0;
    for k in 0..travel.len() {
        if k + 1 == travel.len() || travel[k] - travel[first] >= WINDOW_TRAVEL_M {
            windows.push(first..k + 1);
            first = k + 1;
        }
    }
    // A rest that is too short to say anything goes with its neighbour.
    if let [.., before, last] = &mut windows[..]
        && (travel[last.end - 1] - travel[last.start] < 0.5 * WINDOW_TRAVEL_M || last.len() < 4)
    {
        before.end = last.end;
        windows.pop();
    }
    windows.retain(|w| w.len() > 1);
    windows
}
