//! Which effects pushes can speak about.

use super::effects::all;
use super::setting::GRAVITY_M_S2;
use super::{PushDeclares, SUPPORT_FRICTION};
use crate::effects::Needs;
use crate::model::Parameter;
use crate::statistics::{median, quantile};
use crate::system::Record;

/// How far an object has to coast, in units of the noise of a position, before its inertia shows.
const COASTING: f64 = 3.0;

/// Whether these pushes can speak about the library's effect of this index, and the model does not have it already.
pub(super) fn possible(
    effect: usize,
    parameters: &[Parameter],
    declares: &PushDeclares,
    records: &[&Record],
) -> bool {
    let library = all::<f64>();
    let Some(spec) = library.get(effect).map(|e| e.spec()) else { return false };
    let clash = |kind: &String| kind == spec.kind || spec.excludes.contains(&kind.as_str());
    let friction = parameters.get(SUPPORT_FRICTION).map_or(1.0, |p| p.nominal);
    let slow = || coasting_m(friction, records) < COASTING * position_sd_m(declares, records);
    let clashes = declares.kinds.iter().any(clash);
    !clashes && (spec.needs != Needs::Coasting || !slow())
}

/// How far the object coasts from the speed that the rod reaches in a tenth of the time, m.
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

/// Noise of a position, m: third differences of neighbours, whose sum of squared weights is 20, or the declared one, if that
/// is more.
fn position_sd_m(declares: &PushDeclares, records: &[&Record]) -> f64 {
    let values = records.iter().filter_map(|r| r.values.first());
    let third = |w: &[f64]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs();
    let mut differences: Vec<f64> =
        values.flat_map(|v| v.windows(4).map(third)).filter(|d| d.is_finite()).collect();
    let white = 1.4826 * median(&mut differences) / 20.0_f64.sqrt();
    declares.position_sd_m.unwrap_or(0.0).max(white)
}
