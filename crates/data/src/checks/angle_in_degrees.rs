//! Check for degrees in a column of radians, for pushes only.
//!
//! The path of the rod limits the angle by which it can turn an object.

use super::measured::{Series, rod_path};
use super::{ExpectedData, Finding};
use crate::dataset::Dataset;
use std::f64::consts::TAU;

/// Maximum of (rotation, rad) * (smallest distance of rod and centre) / (path of the rod) for a push.
///
/// Quasi-static pushing turns an object by at most path / (2 c). For a square, c is about 0.7 of that
/// distance, which gives a ratio of 0.7. Measured pushes of a plate on three pins near its middle
/// (cmu-mlab-pushes) reach 1.01. The measured pushes with the smallest ratio (mit-pusher-slider-runs, 0.13)
/// would have 7.5 in degrees.
const MAX_TURN_RATIO: f64 = 1.5;

/// Finds the push that turns most for the path of its rod, where the values must be degrees.
///
/// That is so where its ratio exceeds `MAX_TURN_RATIO` and an angle of the data set exceeds one turn.
pub(super) fn run(data: &Dataset, _: &ExpectedData) -> Vec<Finding> {
    find(data).into_iter().collect()
}

fn find(data: &Dataset) -> Option<Finding> {
    let theta = Series::named(data, "theta_rad")?;
    let mut largest_rad: f64 = 0.0;
    let mut pushes: Vec<(f64, usize, f64, f64)> = Vec::new();
    for (j, t) in data.trajectories().iter().enumerate() {
        let (_, angle) = theta.samples(t);
        largest_rad = angle.iter().fold(largest_rad, |max, a| max.max(a.abs()));
        let rod_m = rod_path(data, t)?;
        let (mut turned, mut low, mut high) = (0.0_f64, 0.0_f64, 0.0_f64);
        for w in angle.windows(2) {
            // A jump by a whole turn is a wrap of the angle.
            let step = w[1] - w[0];
            turned += step - (step / TAU).round() * TAU;
            (low, high) = (low.min(turned), high.max(turned));
        }
        let lever = smallest_distance(data, t)?;
        if rod_m > 0.0 {
            pushes.push(((high - low) * lever / rod_m, j, high - low, rod_m));
        }
    }
    pushes.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    // The largest 5 % are ignored, because a tracker may have confused markers in them.
    let (ratio, j, change_rad, rod_m) = *pushes.get(pushes.len() / 20)?;
    (ratio > MAX_TURN_RATIO && largest_rad > TAU).then(|| Finding::AngleInDegrees {
        trajectory: data.trajectories()[j].id().to_owned(),
        column: theta.name().to_owned(),
        change_rad,
        rod_m,
        largest_rad,
    })
}

/// Smallest distance between rod and object centre, m, over the samples that have both positions.
fn smallest_distance(data: &Dataset, t: &crate::Trajectory) -> Option<f64> {
    let index = |name: &str| data.column_index(name).ok();
    let [rx, ry, x, y] = [index("pusher_x_m")?, index("pusher_y_m")?, index("x_m")?, index("y_m")?];
    let distances =
        (0..t.len()).map(|k| (t.column(rx)[k] - t.column(x)[k]).hypot(t.column(ry)[k] - t.column(y)[k]));
    distances.filter(|d| d.is_finite()).min_by(f64::total_cmp)
}
