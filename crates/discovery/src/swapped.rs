//! Whether the vertical column holds what a horizontal one should.
//!
//! Between impacts the height bends with the acceleration of gravity, and nothing else does. The median over all
//! places of a trajectory, and then over trajectories, does not see the impacts.

use crate::record::{Measured, Record};
use crate::statistics::median;
use augsim_physics::ball::Axes;

/// Share of gravity within which an acceleration is that of a fall: drag and lift change it by less.
const FALLS_WITHIN: f64 = 0.3;
/// Differences are taken over this share of a trajectory: short enough to lie between two impacts at most places,
/// long enough for noise of a hundredth of the height to leave a tenth of gravity.
const REACH_SHARE: f64 = 0.05;

/// The horizontal column that falls in place of the vertical one, and the vertical one; `g_m_s2` is gravity.
pub(crate) fn swapped(data: &Measured, g_m_s2: f64) -> Option<(&'static str, &'static str)> {
    let names: &[&str] = match data.axes {
        Axes::Vertical => return None,
        Axes::Plane => &["x_m", "z_m"],
        Axes::Space => &["x_m", "y_m", "z_m"],
    };
    let falls = |axis: usize| {
        let mut accelerations: Vec<f64> = data.records.iter().filter_map(|r| acceleration(r, axis)).collect();
        let typical = median(&mut accelerations);
        (typical + g_m_s2).abs() < FALLS_WITHIN * g_m_s2
    };
    let vertical = names.len() - 1;
    let falling = (0..vertical).find(|&axis| falls(axis))?;
    (!falls(vertical)).then(|| (names[falling], names[vertical]))
}

/// Median of the second differences of one axis, m/s^2; `None` where too few samples were measured.
fn acceleration(record: &Record, axis: usize) -> Option<f64> {
    let (t, y) = (&record.times, record.y.get(axis)?);
    let reach = ((REACH_SHARE * t.len() as f64) as usize).max(1);
    let mut all: Vec<f64> = (reach..t.len().saturating_sub(reach))
        .filter_map(|k| {
            let (before, after) = (t[k] - t[k - reach], t[k + reach] - t[k]);
            let slopes = (y[k + reach] - y[k]) / after - (y[k] - y[k - reach]) / before;
            let bend = 2.0 * slopes / (before + after);
            bend.is_finite().then_some(bend)
        })
        .collect();
    (!all.is_empty()).then(|| median(&mut all))
}
