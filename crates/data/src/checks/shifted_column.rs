//! A column moved by a row against the others.
//!
//! A shift over the whole file leaves a mark where trajectories meet: the first (or last) sample of a trajectory goes on from
//! its neighbour in the file. A shift within trajectories shows only where another column holds the derivative.

use super::measured::Series;
use super::velocity_disagrees::PAIRS;
use super::{Expected, Finding};
use crate::dataset::Dataset;
use crate::statistics::median;

/// Break of a sample against a straight line through its two neighbours, in units of the typical one of the column.
const BREAK: f64 = 20.0;
/// How much better the sample goes on from the neighbour in the file than from its own trajectory.
const BETTER: f64 = 5.0;
/// Share of the trajectories, per cent, and how many at least. One boundary in a set is chance, more than half are none.
const SHARE: usize = 50;
const FEWEST: usize = 3;
/// Fewest samples of a trajectory with a boundary.
const LONG: usize = 4;
/// How much smaller the velocity's error is at another row than at its own and the next. Schemes that step the velocity
/// first (PyBullet) agree with the next row, others with their own.
const CLEARLY: f64 = 0.5;

/// Boundaries of every column that changes, and heights against velocities.
pub(super) fn look(data: &Dataset, _: &Expected) -> Vec<Finding> {
    let mut findings: Vec<Finding> =
        (0..data.columns().len()).filter_map(|i| at_boundaries(data, Series::at(data, i))).collect();
    findings.extend(PAIRS.iter().filter_map(|pair| against_velocity(data, *pair)));
    findings
}

/// Three values in a row: how far the first is from the line through the others.
fn off_line(first: f64, second: f64, third: f64) -> f64 {
    (first - 2.0 * second + third).abs()
}

fn at_boundaries(data: &Dataset, series: Series<'_>) -> Option<Finding> {
    let all: Vec<Vec<f64>> = data.trajectories().iter().map(|t| series.samples(t).1).collect();
    let mut breaks: Vec<f64> =
        all.iter().flat_map(|v| v.windows(3).map(|w| off_line(w[0], w[1], w[2]))).collect();
    // Half a column at rest has no typical break: then that of the moving half is taken.
    let typical = median(&mut breaks)
        .filter(|m| *m > 0.0)
        .or_else(|| median(&mut breaks.into_iter().filter(|b| *b > 0.0).collect::<Vec<_>>()))?;
    let count = |down: bool| {
        let (mut broken, mut total, mut first) = (0, 0, None);
        for (j, pair) in all.windows(2).enumerate() {
            let [before, after] = [&pair[0][..], &pair[1][..]];
            if before.len() < LONG || after.len() < LONG {
                continue;
            }
            let n = before.len();
            let (own, other, trajectory) = match down {
                // The sample at the start of a trajectory belongs to the end of the one before.
                true => (
                    off_line(after[0], after[1], after[2]),
                    off_line(after[0], before[n - 1], before[n - 2]),
                    j + 1,
                ),
                false => (
                    off_line(before[n - 1], before[n - 2], before[n - 3]),
                    off_line(before[n - 1], after[0], after[1]),
                    j,
                ),
            };
            total += 1;
            if own > BREAK * typical && own > BETTER * other {
                broken += 1;
                first.get_or_insert(trajectory);
            }
        }
        (broken, total, first)
    };
    [true, false].into_iter().find_map(|down| {
        let (broken, total, first) = count(down);
        let t = &data.trajectories()[first?];
        let share = 100 * broken / total;
        let times = series.samples(t).0;
        let time_s = *if down { times.first() } else { times.last() }?;
        (broken >= FEWEST && share >= SHARE).then(|| Finding::ShiftedColumn {
            trajectory: t.id().to_owned(),
            time_s,
            column: series.name().to_owned(),
            share,
        })
    })
}

fn against_velocity(data: &Dataset, [height, velocity]: [&str; 2]) -> Option<Finding> {
    let (z, v) = (Series::named(data, height)?, Series::named(data, velocity)?);
    let error = |rows: i64| {
        let mut sum = 0.0;
        for t in data.trajectories() {
            let ((times, z), (same, v)) = (z.samples(t), v.samples(t));
            if times != same {
                continue;
            }
            // The same intervals at every shift: three rows are left out at both ends.
            for k in 3..times.len().saturating_sub(4) {
                let v = v[(k as i64 + rows) as usize];
                sum += (z[k + 1] - z[k] - v * (times[k + 1] - times[k])).abs();
            }
        }
        sum
    };
    let usual = error(0).min(error(1));
    let others = [-2, -1, 2, 3].map(|rows| (rows, error(rows)));
    let (found, least) = others.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    // One of the two usual schemes explains a row of a velocity that lies behind.
    let rows = if found > 0 { found - 1 } else { found }.unsigned_abs();
    (least < CLEARLY * usual).then(|| Finding::ShiftedVelocity {
        height: height.to_owned(),
        velocity: velocity.to_owned(),
        rows,
    })
}
