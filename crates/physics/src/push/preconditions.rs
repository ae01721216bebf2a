//! Checks whether a set of pushes contains the data that an effect needs.

use super::effects::all;
use super::setting::GRAVITY_M_S2;
use super::{PushDeclaration, SUPPORT_FRICTION_INDEX};
use crate::library::Needs;
use augsim_system::statistics::{median, quantile};
use augsim_system::{Parameter, Record};

/// Smallest coasting distance, in standard deviations of the position, that shows inertia.
const MIN_COASTING_SD: f64 = 3.0;

/// Whether the effect at index `effect` of the library can be tested on these pushes.
///
/// It cannot if the model already has it or an effect that excludes it, or if it needs coasting and the
/// object coasts by less than the noise.
pub(super) fn can_search_effect(
    effect: usize,
    parameters: &[Parameter],
    declares: &PushDeclaration,
    records: &[&Record],
) -> bool {
    let library = all::<f64>();
    let Some(spec) = library.get(effect).map(|e| e.spec()) else { return false };
    let conflicts = |kind: &String| kind == spec.kind || spec.excludes.contains(&kind.as_str());
    let friction = parameters.get(SUPPORT_FRICTION_INDEX).map_or(1.0, |p| p.nominal);
    let coasts_too_little =
        || coasting_m(friction, records) < MIN_COASTING_SD * position_sd_m(declares, records);
    let has_conflict = declares.effect_kinds.iter().any(conflicts);
    !has_conflict && (spec.needs != Needs::Coasting || !coasts_too_little())
}

/// Coasting distance of the object `v²/(2 mu g)`, m, from the 90 % quantile `v` of the rod's speed.
fn coasting_m(support_friction: f64, records: &[&Record]) -> f64 {
    let rods = records.iter().filter_map(|r| r.inputs.first());
    let mut speeds: Vec<f64> = rods
        .filter_map(|rod| Some((&rod.times, rod.values.first()?, rod.values.get(1)?)))
        .flat_map(|(t, x, y)| {
            (1..t.len()).map(|k| (x[k] - x[k - 1]).hypot(y[k] - y[k - 1]) / (t[k] - t[k - 1]))
        })
        .collect();
    speeds.sort_by(f64::total_cmp);
    quantile(&speeds, 0.9).powi(2) / (2.0 * support_friction * GRAVITY_M_S2)
}

/// Standard deviation of a measured position, m: estimated, but at least the declared one.
///
/// The estimate is from third differences of neighbouring samples, which remove smooth motion. Their squared
/// weights sum to 20, and 1.4826 converts a median absolute value to a standard deviation.
fn position_sd_m(declares: &PushDeclaration, records: &[&Record]) -> f64 {
    let values = records.iter().filter_map(|r| r.values.first());
    let third_difference = |w: &[f64]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs();
    let mut differences: Vec<f64> =
        values.flat_map(|v| v.windows(4).map(third_difference)).filter(|d| d.is_finite()).collect();
    let estimated = 1.4826 * median(&mut differences) / 20.0_f64.sqrt();
    declares.position_sd_m.unwrap_or(0.0).max(estimated)
}
