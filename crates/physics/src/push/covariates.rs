//! Quantities against which the residuals of pushes are plotted.

use super::path::{Motion, Path, Recorded};
use augsim_system::Record;

/// Time since the start, and heading and speed of the rod, at each sample of a record.
///
/// Heading and speed are NaN if the rod rests.
pub(super) fn residual_axes(record: &Record) -> Vec<(String, Vec<f64>)> {
    let start_time = record.times.first().copied().unwrap_or(0.0);
    let rod = record.inputs.first();
    let path = rod.and_then(|rod| match &rod.values[..] {
        [x, y] => Recorded::new(&rod.times, x, y),
        _ => None,
    });
    // Velocities of the simplified path: those between single recorded positions are mostly noise at 250 Hz.
    let velocity =
        |time: f64| -> [f64; 2] { path.as_ref().map_or([0.0; 2], |p| p.piece(time).velocity(time)) };
    let while_moving = |time: f64, quantity: fn([f64; 2]) -> f64| {
        let velocity = velocity(time);
        if velocity[0].hypot(velocity[1]) > 0.0 { quantity(velocity) } else { f64::NAN }
    };
    let series = |quantity: fn([f64; 2]) -> f64| {
        record.times.iter().map(|&t| while_moving(t, quantity)).collect::<Vec<_>>()
    };
    vec![
        ("time_s".into(), record.times.iter().map(|t| t - start_time).collect()),
        ("heading_rad".into(), series(|v| v[1].atan2(v[0]))),
        ("speed_m_s".into(), series(|v| v[0].hypot(v[1]))),
    ]
}
