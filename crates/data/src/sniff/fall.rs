//! How coordinates accelerate: which of them falls, which way, and how fast in the unit of the file.

use super::rows::Draft;
use crate::checks::curvature;
use crate::statistics::median;

/// Pieces that a trajectory is cut into, from coarse to fine: a window without an impact is among them.
const PIECES: [usize; 5] = [1, 2, 4, 8, 16];
/// Fewest samples of a window: a parabola has three parameters.
const WINDOW: usize = 7;
/// Gravity, m/s².
pub(super) const GRAVITY: f64 = 9.81;
/// Ratio to gravity, either way, up to which an acceleration is that of a fall: drag takes some of it away, and lengths are
/// measured to a few per cent.
const ALIKE: f64 = 1.3;
/// Frame rates of cameras, Hz.
const RATES: [f64; 15] =
    [24.0, 25.0, 30.0, 50.0, 60.0, 90.0, 100.0, 120.0, 125.0, 200.0, 240.0, 250.0, 480.0, 500.0, 1000.0];
/// Relative deviation up to which a rate is taken for that of a camera.
const NEAR: f64 = 0.03;

/// Median acceleration over the pieces of free motion, in the unit of the column over the square of that of the times;
/// positive where the coordinate grows ever faster. `None` where no piece is a parabola.
pub(super) fn acceleration(drafts: &[Draft], column: usize) -> Option<f64> {
    let one = |draft: &Draft| {
        let seen = |k: &usize| draft.values[column][*k].is_finite();
        let chosen: Vec<usize> = (0..draft.times.len()).filter(seen).collect();
        let times: Vec<f64> = chosen.iter().map(|&k| draft.times[k]).collect();
        let values: Vec<f64> = chosen.iter().map(|&k| draft.values[column][k]).collect();
        let mut all = Vec::new();
        for pieces in PIECES {
            let size = times.len() / pieces;
            if size < WINDOW {
                break;
            }
            let starts = (0..=2 * (pieces - 1)).map(|half| half * size / 2);
            all.extend(starts.filter_map(|a| curvature(&times[a..a + size], &values[a..a + size])));
        }
        median(&mut all)
    };
    median(&mut drafts.iter().filter_map(one).collect::<Vec<_>>())
}

/// Whether an acceleration, m/s², is that of a fall, whichever way is up.
pub(super) fn is_fall(acceleration_m_s2: f64) -> bool {
    let ratio = acceleration_m_s2.abs() / GRAVITY;
    (1.0 / ALIKE..ALIKE).contains(&ratio)
}

/// The unit of length in which an acceleration is that of a fall: its name and size in metres.
pub(super) fn unit_of_fall(acceleration: f64) -> Option<(&'static str, f64)> {
    [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)].into_iter().find(|(_, factor)| is_fall(acceleration * factor))
}

/// The rate of a camera, Hz, at which an acceleration in metres per frame squared is that of a fall.
pub(super) fn rate_of_fall(per_frame: f64) -> Option<f64> {
    let rate = (GRAVITY / per_frame.abs()).sqrt();
    RATES.into_iter().find(|usual| (rate / usual - 1.0).abs() < NEAR)
}
