//! Check for a velocity that is not the rate of change of the height.

use super::measured::Series;
use super::{ExpectedData, Finding};
use crate::dataset::Dataset;

/// Maximum mean difference between height change and velocity integral, relative to the larger of the two.
///
/// Impacts between samples and the integrator of PyBullet leave 0.06 (pybullet-ball); another unit, sign or
/// column leaves 0.9 or more.
const MAX_DIFFERENCE: f64 = 0.5;
/// Number of sample intervals over which the velocity is integrated, to reduce the effect of noise.
const STRIDE: usize = 3;
/// Minimum number of sample intervals that are compared, for a finding.
const MIN_INTERVALS: usize = 30;

/// Names of columns that are compared: pairs of a height and its velocity.
pub(super) const PAIRS: [[&str; 2]; 2] = [["height_m", "velocity_m_s"], ["z_m", "velocity_m_s"]];

/// Finds heights whose change disagrees with the integral of their velocity column.
pub(super) fn run(data: &Dataset, _: &ExpectedData) -> Vec<Finding> {
    PAIRS.iter().filter_map(|pair| disagrees(data, *pair)).collect()
}

fn disagrees(data: &Dataset, [height, velocity]: [&str; 2]) -> Option<Finding> {
    let (z, v) = (Series::named(data, height)?, Series::named(data, velocity)?);
    let (mut count, mut time_s, mut rise, mut integral, mut difference, mut larger) =
        (0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for t in data.trajectories() {
        let ((times, z), (velocity_times, v)) = (z.samples(t), v.samples(t));
        // With gaps in one of them the rows do not correspond.
        if times != velocity_times {
            continue;
        }
        for k in (STRIDE..times.len()).step_by(STRIDE) {
            let intervals = k - STRIDE..k;
            let moved: f64 = intervals.map(|i| 0.5 * (v[i] + v[i + 1]) * (times[i + 1] - times[i])).sum();
            let change = z[k] - z[k - STRIDE];
            count += 1;
            time_s += times[k] - times[k - STRIDE];
            rise += change.abs();
            integral += moved.abs();
            difference += (change - moved).abs();
            larger += change.abs().max(moved.abs());
        }
    }
    let mean = |sum: f64| sum / count as f64;
    (count * STRIDE >= MIN_INTERVALS && difference > MAX_DIFFERENCE * larger).then(|| {
        Finding::VelocityDisagrees {
            height: height.to_owned(),
            velocity: velocity.to_owned(),
            time_s: mean(time_s),
            height_m: mean(rise),
            velocity_m: mean(integral),
        }
    })
}
