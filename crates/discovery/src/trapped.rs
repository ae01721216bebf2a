//! Fits of an effect whose width ran into a bound: from a start that is far off, a jump looks as well the narrower it is, and the
//! step that would widen it is not seen. (Thresholds begin at several places anyhow.)

use crate::addition::Addition;
use crate::fit::{ChosenRecords, Fit, Reach, fit_within};

/// The fit, or a better one that begins at another null point of an added effect whose inner parameters ended on a bound. `starts` has
/// the additions that are new in it with the values that they began at.
pub(crate) fn freed(
    sample: &ChosenRecords<'_>,
    found: Fit,
    starts: &[(Addition, Vec<f64>)],
    reach: Reach,
) -> Fit {
    let system = found.hypothesis.system.clone();
    if !system.begins_from_first_samples() {
        return found;
    }
    let mut best = found;
    for (addition, start) in starts {
        let Addition::Effect(listed, _) = addition else { continue };
        let Some(number) = best.hypothesis.additions.iter().position(|a| a == addition) else { continue };
        let own = best.hypothesis.range_of(number);
        let amounts = listed.effect.amounts.unwrap_or(own.len());
        let is_threshold = !system.scan_points(listed.index).is_empty();
        if is_threshold || start.len() != own.len() || !is_trapped(&best, own.clone().skip(amounts)) {
            continue;
        }
        let bounds = best.hypothesis.bounds();
        for point in system.null_points(listed.index) {
            let mut theta = best.theta.clone();
            for (k, i) in own.clone().enumerate() {
                let value = if k < amounts { start[k] } else { point.get(k).copied().unwrap_or(theta[i]) };
                theta[i] = value.clamp(bounds[i].0, bounds[i].1);
            }
            let other = fit_within(sample, &best.hypothesis, &theta, &best.nuisance, reach.or(best.cost));
            if other.cost < best.cost {
                best = other;
            }
        }
    }
    best
}

/// Whether one of some parameters stands on a bound.
fn is_trapped(fit: &Fit, mut inner: impl Iterator<Item = usize>) -> bool {
    let bounds = fit.hypothesis.bounds();
    inner.any(|i| fit.theta[i] <= bounds[i].0 || fit.theta[i] >= bounds[i].1)
}
