//! Quantities against which the residuals of throws are plotted.

use augsim_system::{Event, Record};

/// Time, height, speed and number of preceding impacts (of the simulated `events`) at each sample.
///
/// Speed is a difference over one step, NaN at the first sample and after a gap.
pub(super) fn residual_axes(record: &Record, events: &[Event]) -> Vec<(String, Vec<f64>)> {
    let samples = record.times.len();
    let height = record.values.last().cloned().unwrap_or_default();
    let speed = |k: usize| {
        if k == 0 || !record.is_correlated_with(k - 1, k) {
            return f64::NAN;
        }
        let dt = record.times[k] - record.times[k - 1];
        let rates = record.values.iter().map(|y| (y[k] - y[k - 1]).powi(2));
        rates.sum::<f64>().sqrt() / dt
    };
    let bounce = |k: usize| events.iter().filter(|e| e.time_s < record.times[k]).count() as f64;
    vec![
        ("time_s".into(), record.times.clone()),
        ("height_m".into(), height),
        ("speed_m_s".into(), (0..samples).map(speed).collect()),
        ("bounce".into(), (0..samples).map(bounce).collect()),
    ]
}
