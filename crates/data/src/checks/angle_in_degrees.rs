//! Degrees in a column of radians, told by pushes: a rod cannot turn an object further than its path reaches round it.

use super::measured::{Series, rod_path};
use super::{Expected, Finding};
use crate::dataset::Dataset;
use std::f64::consts::TAU;

/// Largest change of the angle times the nearest distance of rod and centre, in units of the rod's path. Quasi-static
/// pushing turns by at most path/(2 c), with c about 0.7 of that distance for a square, so 0.7; measured pushes of a plate on
/// three pins near its middle (cmu-mlab-pushes) reach 1.01 and never leave one turn. The measured pushes that turn least
/// (mit-pusher-slider-runs, 0.13) give 7.5 in degrees.
const TURN: f64 = 1.5;

/// The push that turns furthest for its rod's path, where the set's angles leave one turn.
pub(super) fn look(data: &Dataset, _: &Expected) -> Vec<Finding> {
    find(data).into_iter().collect()
}

fn find(data: &Dataset) -> Option<Finding> {
    let theta = Series::named(data, "theta_rad")?;
    let mut largest_rad: f64 = 0.0;
    let mut pushes: Vec<(f64, usize, f64, f64)> = Vec::new();
    for (j, t) in data.trajectories().iter().enumerate() {
        let (_, angle) = theta.samples(t);
        largest_rad = angle.iter().fold(largest_rad, |most, a| most.max(a.abs()));
        let rod_m = rod_path(data, t)?;
        let (mut now, mut low, mut high) = (0.0_f64, 0.0_f64, 0.0_f64);
        for w in angle.windows(2) {
            // A jump by a whole turn is a change of branch.
            let step = w[1] - w[0];
            now += step - (step / TAU).round() * TAU;
            (low, high) = (low.min(now), high.max(now));
        }
        let lever = nearest(data, t)?;
        if rod_m > 0.0 {
            pushes.push(((high - low) * lever / rod_m, j, high - low, rod_m));
        }
    }
    pushes.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    // One in twenty may be a tracker's confusion.
    let (ratio, j, change_rad, rod_m) = *pushes.get(pushes.len() / 20)?;
    (ratio > TURN && largest_rad > TAU).then(|| Finding::AngleInDegrees {
        trajectory: data.trajectories()[j].id().to_owned(),
        column: theta.name().to_owned(),
        change_rad,
        rod_m,
        largest_rad,
    })
}

/// Smallest distance between rod and centre at a row with both, m.
fn nearest(data: &Dataset, t: &crate::Trajectory) -> Option<f64> {
    let index = |name: &str| data.column_index(name).ok();
    let [rx, ry, x, y] = [index("pusher_x_m")?, index("pusher_y_m")?, index("x_m")?, index("y_m")?];
    let distances =
        (0..t.len()).map(|k| (t.column(rx)[k] - t.column(x)[k]).hypot(t.column(ry)[k] - t.column(y)[k]));
    distances.filter(|d| d.is_finite()).min_by(f64::total_cmp)
}
