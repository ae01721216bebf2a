//! Distribution of the parameters after the recordings so far, under the noise of the explanation.
//!
//! The prior of a parameter is as wide as its bounds; the distribution after the recordings is at the maximum of `joint.rs`.

use crate::error::DesignError;
use crate::explanation::Explanation;
use crate::joint::Joint;
use augsim_system::Record;

/// Standard deviation of the prior of a parameter without finite bounds, in standard errors of its fit.
const PRIOR_ERRORS: f64 = 100.0;

/// Standard deviation of the prior of such a parameter for draws of possible true values, in standard errors of its fit.
///
/// A parameter that the recordings determine keeps 0.95 of its standard error. One that they do not determine, as the force
/// of a table at speeds that were not reached, is drawn from the prior; a hundred standard errors would be no possible value.
const DRAW_ERRORS: f64 = 3.0;

/// Computes the distribution of an explanation's parameters after recordings, from a prior as wide as their bounds.
///
/// # Errors
/// A recording cannot be simulated at the fitted values.
pub fn after_recordings(explanation: &Explanation, records: &[Record]) -> Result<Explanation, DesignError> {
    after_recordings_from(&with_prior(explanation), records)
}

/// As [`after_recordings`], from a prior and the start of the search in it, as [`with_prior`] gives them.
pub(crate) fn after_recordings_from(
    (broad, start): &(Explanation, Vec<f64>),
    records: &[Record],
) -> Result<Explanation, DesignError> {
    let mut joint = Joint::new(broad, 1.0, start.clone());
    joint.add_all(records)?;
    Ok(joint.updated())
}

/// The explanation with a prior as wide as the bounds of each parameter, about their middle.
///
/// Second are the explanation's values in units of that prior, whose factor is diagonal.
pub(crate) fn with_prior(e: &Explanation) -> (Explanation, Vec<f64>) {
    let mut broad = e.clone();
    let count = e.uncertain.len();
    broad.factor = vec![vec![0.0; count]; count];
    for (k, (index, fitted_sd)) in e.uncertain.iter().zip(e.coordinate_sds()).enumerate() {
        let p = &e.system.parameters()[*index];
        let [low, high] = [p.min, p.max].map(|bound| e.coordinate(*index, bound));
        let width = (high - low) / 12.0_f64.sqrt();
        let most = PRIOR_ERRORS * fitted_sd;
        // Bounds far wider than the fit's error add nothing; a prior about the fitted value is then as good.
        if width.is_finite() && (width <= most || fitted_sd <= 0.0) {
            broad.values[*index] = e.value_at(*index, 0.5 * (low + high));
            broad.factor[k][k] = width;
        } else {
            broad.factor[k][k] = most;
        }
    }
    let start = |(k, index): (usize, &usize)| match broad.factor[k][k] {
        sd if sd > 0.0 => {
            let [value, middle] = [e, &broad].map(|e| broad.coordinate(*index, e.values[*index]));
            (value - middle) / sd
        }
        _ => 0.0,
    };
    let start = broad.uncertain.iter().enumerate().map(start).collect();
    (broad, start)
}

/// As [`with_prior`] for draws of possible true values: narrower for parameters without finite bounds.
pub(crate) fn with_prior_of_draws(e: &Explanation) -> (Explanation, Vec<f64>) {
    let (mut prior, start) = with_prior(e);
    for (k, (index, fitted_sd)) in e.uncertain.iter().zip(e.coordinate_sds()).enumerate() {
        let p = &e.system.parameters()[*index];
        if !(p.max - p.min).is_finite() {
            // Its prior is about the fitted value, where the search starts.
            prior.factor[k][k] = DRAW_ERRORS * fitted_sd;
        }
    }
    (prior, start)
}
