//! Standard deviation of the event offsets at a fit.

use crate::evaluate::{Lanes, NormalEquations};
use crate::hypothesis::Hypothesis;

/// Minimum standard deviation of a random effect, in units of its typical size; from 0 it could not grow.
const MIN_SCATTER: f64 = 5e-4;

/// Standard deviation of the offsets of the events' parameter, estimated at a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Spread {
    /// Standard deviation of the offsets, in the parameter's unit (MacKay's fixed point, Neural Computation
    /// 4:415, 1992).
    pub sd: f64,
    /// Effective number of offsets; poorly determined ones count less.
    pub draws: f64,
}

/// Estimates the standard deviation of the event offsets (deviations of the events' parameter) in `nuisance`,
/// whose prior has the standard deviation `sd`.
pub(crate) fn offset_spread(
    h: &Hypothesis,
    lanes: &[Lanes],
    normals: &[NormalEquations],
    nuisance: &[Vec<f64>],
    sd: f64,
) -> Spread {
    let (mut sum, mut freedom, mut draws) = (0.0, 0.0, 0.0);
    for ((l, normal), n) in lanes.iter().zip(normals).zip(nuisance) {
        let tail: Vec<usize> = (l.common()..normal.h.n).collect();
        let c = normal.h.sub(&tail).cholesky().inverse();
        let first = l.state_nuisances();
        // A window that the model does not fit has little weight in the scatter.
        let weight = normal.weight.min(1.0);
        for i in first..first + l.offsets {
            let Some(x) = n.get(i) else { continue };
            // Share of the offset's information that comes from the data rather than from the prior.
            let informed = 1.0 - c.at(i, i) / (sd * sd);
            sum += weight * x * x;
            freedom += weight * informed;
            draws += weight * informed * informed;
        }
    }
    let (least, most) = scatter_bounds(h);
    let sd = f64::sqrt(sum / f64::max(freedom, 1e-6)).clamp(least, most);
    Spread { sd, draws }
}

/// Minimum and maximum standard deviation of the events' random effect, in the unit of the parameter.
pub(crate) fn scatter_bounds(h: &Hypothesis) -> (f64, f64) {
    let event = h.system.schema().event.as_ref();
    let sd = event.and_then(|e| e.scatter.parameters.first());
    sd.map_or((0.0, f64::INFINITY), |p| (MIN_SCATTER * p.typical, p.max))
}
