//! Infers the vertical coordinate, the unit of length and the frame rate from free fall at 9.81 m/s².

use super::rows::Draft;
use crate::checks::free_motion_acceleration;
use crate::statistics::median;

/// Gravity of the Earth, m/s².
pub(super) const GRAVITY: f64 = 9.81;
/// Maximum ratio of a measured free-fall acceleration to gravity, and of gravity to the acceleration.
///
/// Drag reduces the acceleration, and lengths are measured to a few per cent.
const MAX_GRAVITY_RATIO: f64 = 1.3;
/// Usual frame rates of cameras, Hz.
const CAMERA_RATES: [f64; 15] =
    [24.0, 25.0, 30.0, 50.0, 60.0, 90.0, 100.0, 120.0, 125.0, 200.0, 240.0, 250.0, 480.0, 500.0, 1000.0];
/// Maximum relative deviation of an inferred frame rate from a usual one.
const MAX_RATE_DEVIATION: f64 = 0.03;

/// Median acceleration of a column over its parabolic parts; `None` where there are none.
///
/// The unit is that of the column over the square of that of the times.
pub(super) fn acceleration(drafts: &[Draft], column: usize) -> Option<f64> {
    let of_draft = |draft: &Draft| {
        let is_measured = |k: &usize| draft.values[column][*k].is_finite();
        let measured: Vec<usize> = (0..draft.times.len()).filter(is_measured).collect();
        let times: Vec<f64> = measured.iter().map(|&k| draft.times[k]).collect();
        let values: Vec<f64> = measured.iter().map(|&k| draft.values[column][k]).collect();
        free_motion_acceleration(&times, &values)
    };
    median(&mut drafts.iter().filter_map(of_draft).collect::<Vec<_>>())
}

/// Whether an acceleration, m/s², is about that of gravity (`MAX_GRAVITY_RATIO`), in either direction.
pub(super) fn is_fall(acceleration_m_s2: f64) -> bool {
    let ratio = acceleration_m_s2.abs() / GRAVITY;
    (1.0 / MAX_GRAVITY_RATIO..MAX_GRAVITY_RATIO).contains(&ratio)
}

/// Unit of length in which an acceleration is that of free fall: its name and its size, m.
pub(super) fn unit_of_fall(acceleration: f64) -> Option<(&'static str, f64)> {
    [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)].into_iter().find(|(_, factor)| is_fall(acceleration * factor))
}

/// Usual frame rate, Hz, at which an acceleration in metres per frame squared is that of free fall.
pub(super) fn rate_of_fall(per_frame: f64) -> Option<f64> {
    let rate = (GRAVITY / per_frame.abs()).sqrt();
    CAMERA_RATES.into_iter().find(|usual| (rate / usual - 1.0).abs() < MAX_RATE_DEVIATION)
}
