//! Outline and rod of a push, which a view from above shows beside the poses.

use super::ROD_RADIUS;
use super::world::World;
use crate::system::{Record, TopView};

/// Corners of a drawn outline that is no polygon.
const SIDES: usize = 48;

/// The object's outline, and the rod at these times with parameter `values`.
pub(super) fn top_view(world: &World, record: &Record, times: &[f64], values: &[f64]) -> Option<TopView> {
    let rod = record.inputs.first()?;
    let [x, y] = &rod.values[..] else { return None };
    Some(TopView {
        outline_m: world.object().outline.polygon(SIDES).vertices().to_vec(),
        rod_m: times.iter().map(|&t| [linear(&rod.times, x, t), linear(&rod.times, y, t)]).collect(),
        rod_radius_m: *values.get(ROD_RADIUS)?,
    })
}

/// A value at a time: linear between samples, at rest outside them.
fn linear(times: &[f64], values: &[f64], t: f64) -> f64 {
    let last = times.len() - 1;
    let k = times.partition_point(|&s| s <= t).clamp(1, last.max(1)) - 1;
    let next = (k + 1).min(last);
    let span = times[next] - times[k];
    let share = if span > 0.0 { ((t - times[k]) / span).clamp(0.0, 1.0) } else { 0.0 };
    values[k] + share * (values[next] - values[k])
}

#[cfg(test)]
mod tests {
    //! Contract: the rod is where a straight line between its samples has it, and where it began or ended outside them.
    use super::*;

    #[test]
    fn the_rod_goes_in_straight_lines() {
        let (times, x) = ([0.0, 1.0, 3.0], [0.0, 2.0, 2.5]);
        for (t, expected) in [(-1.0, 0.0), (0.5, 1.0), (1.0, 2.0), (2.0, 2.25), (9.0, 2.5)] {
            assert_eq!(linear(&times, &x, t), expected, "at {t} s");
        }
        assert_eq!(linear(&[2.0], &[7.0], 0.0), 7.0);
    }
}
