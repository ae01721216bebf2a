//! Outline and rod positions of a push, for drawing it from above.

use super::ROD_RADIUS_INDEX;
use super::world::World;
use augsim_system::{Record, TopView};

/// Number of sides with which an ellipse is drawn.
const ELLIPSE_SIDES: usize = 48;

/// Outline of the object and rod positions at `times`, s; `values` are the parameter values of `world`.
///
/// Returns `None` if the record has no rod with two columns.
pub(super) fn top_view(world: &World, record: &Record, times: &[f64], values: &[f64]) -> Option<TopView> {
    let rod = record.inputs.first()?;
    let [x, y] = &rod.values[..] else { return None };
    Some(TopView {
        outline_m: world.object().outline.polygon(ELLIPSE_SIDES).vertices().to_vec(),
        rod_m: times
            .iter()
            .map(|&t| [interpolated(&rod.times, x, t), interpolated(&rod.times, y, t)])
            .collect(),
        rod_radius_m: *values.get(ROD_RADIUS_INDEX)?,
    })
}

/// Value at time `t`, s: linear between the samples of `values`, constant outside them.
fn interpolated(times: &[f64], values: &[f64], t: f64) -> f64 {
    let last = times.len() - 1;
    let k = times.partition_point(|&s| s <= t).clamp(1, last.max(1)) - 1;
    let next = (k + 1).min(last);
    let span = times[next] - times[k];
    let fraction = if span > 0.0 { ((t - times[k]) / span).clamp(0.0, 1.0) } else { 0.0 };
    values[k] + fraction * (values[next] - values[k])
}

#[cfg(test)]
mod tests {
    //! Contract: the rod position is linear between samples and constant before the first and after the last.
    use super::*;

    #[test]
    fn rod_position_is_linear_between_samples_and_constant_outside() {
        let (times, x) = ([0.0, 1.0, 3.0], [0.0, 2.0, 2.5]);
        for (t, expected) in [(-1.0, 0.0), (0.5, 1.0), (1.0, 2.0), (2.0, 2.25), (9.0, 2.5)] {
            assert_eq!(interpolated(&times, &x, t), expected, "at {t} s");
        }
        assert_eq!(interpolated(&[2.0], &[7.0], 0.0), 7.0);
    }
}
