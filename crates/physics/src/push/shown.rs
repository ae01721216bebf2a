//! Quantities that residuals of pushes are shown against.

use super::path::{Motion, Path, Recorded};
use crate::system::Record;

/// Time since the beginning, heading and speed of the rod, sample by sample; not a number where the rod rests.
pub(super) fn shown_against(record: &Record) -> Vec<(String, Vec<f64>)> {
    let begin = record.times.first().copied().unwrap_or(0.0);
    let rod = record.inputs.first();
    let path = rod.and_then(|rod| match &rod.values[..] {
        [x, y] => Recorded::new(&rod.times, x, y),
        _ => None,
    });
    // Velocities of the path that is simulated: those of single recorded positions are noise at 250 Hz.
    let velocity =
        |time: f64| -> [f64; 2] { path.as_ref().map_or([0.0; 2], |p| p.piece(time).velocity(time)) };
    let moving = |time: f64, of: fn([f64; 2]) -> f64| {
        let velocity = velocity(time);
        if velocity[0].hypot(velocity[1]) > 0.0 { of(velocity) } else { f64::NAN }
    };
    let all = |of: fn([f64; 2]) -> f64| record.times.iter().map(|&t| moving(t, of)).collect::<Vec<_>>();
    vec![
        ("time_s".into(), record.times.iter().map(|t| t - begin).collect()),
        ("heading_rad".into(), all(|v| v[1].atan2(v[0]))),
        ("speed_m_s".into(), all(|v| v[0].hypot(v[1]))),
    ]
}
