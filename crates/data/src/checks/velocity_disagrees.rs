//! A velocity that is not the change of the height.

use super::measured::Series;
use super::{Expected, Finding};
use crate::dataset::Dataset;

/// Mean difference between the height's change and the velocity's integral, as a share of the larger of the two, from which
/// they are not of one motion. Impacts between samples and the stepping of PyBullet leave 0.06
/// (pybullet-ball); another unit, sign or column leaves 0.9 or more.
const APART: f64 = 0.5;
/// Samples over which the velocity is integrated: noise of the heights counts less over several.
const OVER: usize = 3;
/// Fewest intervals of which it can be told.
const FEWEST: usize = 30;

/// The pairs of columns that are compared.
pub(super) const PAIRS: [[&str; 2]; 2] = [["height_m", "velocity_m_s"], ["z_m", "velocity_m_s"]];

/// Each pair that the set has.
pub(super) fn look(data: &Dataset, _: &Expected) -> Vec<Finding> {
    PAIRS.iter().filter_map(|pair| disagrees(data, *pair)).collect()
}

fn disagrees(data: &Dataset, [height, velocity]: [&str; 2]) -> Option<Finding> {
    let (z, v) = (Series::named(data, height)?, Series::named(data, velocity)?);
    let (mut count, mut time_s, mut rise, mut integral, mut apart, mut larger) = (0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for t in data.trajectories() {
        let ((times, z), (same, v)) = (z.samples(t), v.samples(t));
        // Gaps in one of them leave nothing to compare row by row.
        if times != same {
            continue;
        }
        for k in (OVER..times.len()).step_by(OVER) {
            let over = k - OVER..k;
            let moved: f64 = over.map(|i| 0.5 * (v[i] + v[i + 1]) * (times[i + 1] - times[i])).sum();
            let change = z[k] - z[k - OVER];
            count += 1;
            time_s += times[k] - times[k - OVER];
            rise += change.abs();
            integral += moved.abs();
            apart += (change - moved).abs();
            larger += change.abs().max(moved.abs());
        }
    }
    let mean = |sum: f64| sum / count as f64;
    (count * OVER >= FEWEST && apart > APART * larger).then(|| Finding::VelocityDisagrees {
        height: height.to_owned(),
        velocity: velocity.to_owned(),
        time_s: mean(time_s),
        height_m: mean(rise),
        velocity_m: mean(integral),
    })
}
