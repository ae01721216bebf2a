//! Check for a column that is shifted by a row relative to the others.
//!
//! A shift over the whole file shows at the boundaries of trajectories: the first (or last) sample of a
//! trajectory continues the neighbouring trajectory in the file. A shift within trajectories shows only where
//! another column holds the derivative.

use super::measured::Series;
use super::velocity_disagrees::PAIRS;
use super::{ExpectedData, Finding};
use crate::dataset::Dataset;
use crate::statistics::median;

/// Minimum second difference of a shifted sample at a trajectory's end, relative to the median of the column.
const MIN_BREAK: f64 = 20.0;
/// Minimum ratio of the second difference at a trajectory's end to that across to the next trajectory.
const MIN_BREAK_RATIO: f64 = 5.0;
/// Minimum share of the trajectory boundaries that show a shift, per cent; a few may be chance.
const MIN_SHARE: usize = 50;
/// Minimum number of trajectory boundaries that show a shift, for a finding.
const MIN_BREAKS: usize = 3;
/// Minimum number of samples of both trajectories at a boundary that is tested.
const MIN_SAMPLES: usize = 4;
/// Maximum error of the height changes with a shifted velocity, relative to the error without a shift.
///
/// The error without a shift is the smaller one with the velocity of the same or the next row: integrators that update
/// the velocity first (PyBullet) agree with the next row, others with their own row.
const MAX_ERROR_RATIO: f64 = 0.5;

/// Finds columns shifted by a row, from the ends of trajectories and from each height with its velocity.
pub(super) fn run(data: &Dataset, _: &ExpectedData) -> Vec<Finding> {
    let mut findings: Vec<Finding> = (0..data.columns().len())
        .filter_map(|i| shift_at_boundaries(data, Series::of_column(data, i)))
        .collect();
    findings.extend(PAIRS.iter().filter_map(|pair| shift_of_velocity(data, *pair)));
    findings
}

/// Absolute second difference of three values: distance of the first from the line through the other two.
fn second_difference(first: f64, second: f64, third: f64) -> f64 {
    (first - 2.0 * second + third).abs()
}

fn shift_at_boundaries(data: &Dataset, series: Series<'_>) -> Option<Finding> {
    let all: Vec<Vec<f64>> = data.trajectories().iter().map(|t| series.samples(t).1).collect();
    let mut breaks: Vec<f64> =
        all.iter().flat_map(|v| v.windows(3).map(|w| second_difference(w[0], w[1], w[2]))).collect();
    // Where half of a column is at rest the median is 0; then the median of the non-zero breaks is used.
    let typical = median(&mut breaks)
        .filter(|m| *m > 0.0)
        .or_else(|| median(&mut breaks.into_iter().filter(|b| *b > 0.0).collect::<Vec<_>>()))?;
    let count = |is_down: bool| {
        let (mut broken, mut total, mut first) = (0, 0, None);
        for (j, pair) in all.windows(2).enumerate() {
            let [before, after] = [&pair[0][..], &pair[1][..]];
            if before.len() < MIN_SAMPLES || after.len() < MIN_SAMPLES {
                continue;
            }
            let n = before.len();
            let (inside, across, trajectory) = match is_down {
                // A downward shift moves the last sample of a trajectory to the start of the next one.
                true => (
                    second_difference(after[0], after[1], after[2]),
                    second_difference(after[0], before[n - 1], before[n - 2]),
                    j + 1,
                ),
                false => (
                    second_difference(before[n - 1], before[n - 2], before[n - 3]),
                    second_difference(before[n - 1], after[0], after[1]),
                    j,
                ),
            };
            total += 1;
            if inside > MIN_BREAK * typical && inside > MIN_BREAK_RATIO * across {
                broken += 1;
                first.get_or_insert(trajectory);
            }
        }
        (broken, total, first)
    };
    [true, false].into_iter().find_map(|is_down| {
        let (broken, total, first) = count(is_down);
        let t = &data.trajectories()[first?];
        let share = 100 * broken / total;
        let times = series.samples(t).0;
        let time_s = *if is_down { times.first() } else { times.last() }?;
        (broken >= MIN_BREAKS && share >= MIN_SHARE).then(|| Finding::ShiftedColumn {
            trajectory: t.id().to_owned(),
            time_s,
            column: series.name().to_owned(),
            share,
        })
    })
}

/// Finds the shift, in rows, at which the velocity agrees best with the change of the height per row.
fn shift_of_velocity(data: &Dataset, [height, velocity]: [&str; 2]) -> Option<Finding> {
    let (z, v) = (Series::named(data, height)?, Series::named(data, velocity)?);
    let error = |rows: i64| {
        let mut sum = 0.0;
        for t in data.trajectories() {
            let ((times, z), (velocity_times, v)) = (z.samples(t), v.samples(t));
            if times != velocity_times {
                continue;
            }
            // Three rows are left out at both ends, so that every shift compares the same intervals.
            for k in 3..times.len().saturating_sub(4) {
                let v = v[(k as i64 + rows) as usize];
                sum += (z[k + 1] - z[k] - v * (times[k + 1] - times[k])).abs();
            }
        }
        sum
    };
    let usual = error(0).min(error(1));
    let others = [-2, -1, 2, 3].map(|rows| (rows, error(rows)));
    let (found, min_error) = others.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    // One of the two usual integrators explains one row of a positive shift.
    let rows = if found > 0 { found - 1 } else { found }.unsigned_abs();
    (min_error < MAX_ERROR_RATIO * usual).then(|| Finding::ShiftedVelocity {
        height: height.to_owned(),
        velocity: velocity.to_owned(),
        rows,
    })
}
