//! The verdict, and the tests whether the data are from the declared system.

use super::ResidualTests;
use crate::fit::Fit;
use crate::prepare::Prepared;
use crate::result::{ErrorTable, Verdict};
use augsim_data::with_significant;

/// Reason why the findings of a search are withdrawn.
pub(crate) enum WithdrawalReason {
    /// The data are not from the declared system; contains the explanation.
    NotThisSystem(String),
    /// The chosen set of effects predicts no better than the calibrated model.
    DoesNotHelp,
}

/// Verdict from whether effects are named, whether a tabulated effect was found, and the residual tests.
pub(crate) fn verdict(is_named: bool, has_table: bool, left: &ResidualTests) -> Verdict {
    match (is_named, has_table || !left.none_is_significant()) {
        (true, false) => Verdict::Explained,
        (true, true) => Verdict::PartlyExplained,
        (false, true) => Verdict::Unknown,
        (false, false) => Verdict::NothingToAdd,
    }
}

/// Reason why the data are not from the declared system, checked before any fit; `None` if they can be.
pub(crate) fn reason_from_data(prepared: &Prepared) -> Option<String> {
    let data = &prepared.data;
    data.system
        .foreign_records_objection(&data.system_records(), &prepared.noise.sd)
        .map(|objection| objection.to_string())
}

/// Values of all parameters of the system after a fit; groupwise values as their mean.
fn values(fit: &Fit) -> Vec<f64> {
    let h = &fit.hypothesis;
    let mut values = h.values.clone();
    for (f, range) in h.entries() {
        let width = range.len();
        if width > 0 {
            values[f.index] = fit.theta[range].iter().sum::<f64>() / width as f64;
        }
    }
    values
}

/// Rejects fitted values that are implausible for the system or at a bound; `None` if they are plausible.
pub(crate) fn reason_from_values(fit: &Fit) -> Option<WithdrawalReason> {
    let h = &fit.hypothesis;
    if let Some(objection) = h.system.implausible_values_objection(&values(fit)) {
        return Some(WithdrawalReason::NotThisSystem(objection.to_string()));
    }
    let (name, bound) = h.declared_parameter_at_bound(&fit.theta)?;
    Some(WithdrawalReason::NotThisSystem(format!(
        "the fitted value of `{name}` is at its bound {bound}: if values beyond it are possible, widen the bound in the model file; otherwise \
         check the units, the signs, and that the recording is of the declared system"
    )))
}

/// Rejects predictions that are worse than the mean of the data, or findings that increase the error.
/// `spread` is the standard deviation of the deciding measure, `display` its display unit and factor.
pub(crate) fn reason_from_errors(
    error: &ErrorTable,
    spread: f64,
    has_additions: bool,
    display: (&str, f64),
) -> Option<WithdrawalReason> {
    let (unit, scale) = display;
    let best =
        if has_additions { error.augmented.rmse.min(error.calibrated.rmse) } else { error.calibrated.rmse };
    if best > spread && best > error.noise_floor.rmse {
        return Some(WithdrawalReason::NotThisSystem(format!(
            "the calibrated model predicts the records worse than their mean does: its error is {} {unit}, their standard deviation \
             {} {unit}; check the units, the signs, and that the recording is of the declared system",
            with_significant(scale * error.calibrated.rmse, 4),
            with_significant(scale * spread, 4)
        )));
    }
    // An interval below 0 is a significant increase of the error.
    (has_additions && error.reduction.ci95[1] < 0.0).then_some(WithdrawalReason::DoesNotHelp)
}
