//! The verdict, and when the data are not those of the declared system.

use super::Remainder;
use crate::fit::Fit;
use crate::hypothesis::Hypothesis;
use crate::prepare::Prepared;
use crate::result::{ErrorTable, Verdict};
use augsim_physics::model::Per;

/// Share of a parameter's range within which it stands at a bound.
const AT_BOUND: f64 = 1e-6;

/// Why an answer is not given as it was found.
pub(crate) enum Doubt {
    /// The data are not of the declared system, in words.
    NotThisSystem(String),
    /// The set that was found predicts no better than the calibrated model.
    DoesNotHelp,
}

/// The verdict on a set: whether it has effects of the library or a scatter, whether it has laws of one quantity, and what it leaves.
pub(crate) fn verdict(is_named: bool, has_table: bool, left: &Remainder) -> Verdict {
    match (is_named, has_table || !left.is_nothing()) {
        (true, false) => Verdict::Explained,
        (true, true) => Verdict::PartlyExplained,
        (false, true) => Verdict::Unknown,
        (false, false) => Verdict::NothingToAdd,
    }
}

/// Why the data are not of the declared system, before anything is fitted.
pub(crate) fn before_search(prepared: &Prepared) -> Option<String> {
    let data = &prepared.data;
    data.system.unlike(&data.seen(), &prepared.noise.sd).map(|objection| objection.to_string())
}

/// Values of all parameters of the system after a fit; of those with values by group the mean.
fn values(fit: &Fit) -> Vec<f64> {
    let h = &fit.hypothesis;
    let mut all = h.values.clone();
    let mut at = 0;
    for f in &h.free {
        let width = h.width(f);
        if width > 0 {
            all[f.index] = fit.theta[at..at + width].iter().sum::<f64>() / width as f64;
        }
        at += width;
    }
    all
}

/// The doubt that a fitted set leaves by its values: they cannot be those of such a system, or stand at a bound.
pub(crate) fn of_values(fit: &Fit) -> Option<Doubt> {
    let h = &fit.hypothesis;
    if let Some(objection) = h.system.implausible(&values(fit)) {
        return Some(Doubt::NotThisSystem(objection.to_string()));
    }
    let (name, bound) = at_bound(h, &fit.theta)?;
    Some(Doubt::NotThisSystem(format!(
        "`{name}` comes out at its bound of {bound}: widen the bound in the model file if such a value can be, otherwise check units, \
         signs and what was measured"
    )))
}

/// The doubt that predictions leave: `spread` is what the quantity that decides does about its mean, in the unit of the table.
pub(crate) fn of_errors(error: &ErrorTable, spread: f64, adds: bool, told: (&str, f64)) -> Option<Doubt> {
    let (unit, scale) = told;
    let best = if adds { error.augmented.rmse.min(error.calibrated.rmse) } else { error.calibrated.rmse };
    if best > spread && best > error.noise_floor.rmse {
        return Some(Doubt::NotThisSystem(format!(
            "the calibrated model predicts the records worse than their mean: {:.3} {unit}, where they vary by {:.3} {unit}; check units, \
             signs and whether the recording is of what the model declares",
            scale * error.calibrated.rmse,
            scale * spread
        )));
    }
    // An interval that lies below 0 is a loss that is no accident.
    (adds && error.reduction.ci95[1] < 0.0).then_some(Doubt::DoesNotHelp)
}

/// Name and bound of the first declared parameter that stands at one which is not 0: at 0 a term is only absent.
fn at_bound(h: &Hypothesis, theta: &[f64]) -> Option<(String, f64)> {
    let mut at = 0;
    for f in &h.free {
        let width = h.width(f);
        let own = &theta[at..at + width];
        at += width;
        if f.addition.is_some() || f.per == Per::Trajectory {
            continue;
        }
        let near = AT_BOUND * (f.max - f.min);
        for bound in [f.min, f.max].into_iter().filter(|b| *b != 0.0) {
            if own.iter().any(|v| (v - bound).abs() <= near) {
                return Some((h.system.quantity(f.index).name, bound));
            }
        }
    }
    None
}
