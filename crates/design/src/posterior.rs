//! Distribution of the parameters after the recordings so far, under the noise of the explanation.
//!
//! The prior of a parameter is as wide as its bounds; the distribution after the recordings is that of `evidence.rs`.

use crate::error::DesignError;
use crate::evidence::Evidence;
use crate::explanation::Explanation;
use augsim_system::Record;

/// Standard deviation of the prior of a parameter without finite bounds, in standard errors of its fit.
const PRIOR_ERRORS: f64 = 100.0;

/// Computes the distribution of an explanation's parameters after recordings, from a prior as wide as their bounds.
///
/// # Errors
/// A recording cannot be simulated at the fitted values.
pub fn after_recordings(explanation: &Explanation, records: &[Record]) -> Result<Explanation, DesignError> {
    let broad = with_prior(explanation);
    // The fitted values in units of the prior, whose factor is diagonal.
    let xi = |(k, index): (usize, &usize)| match broad.factor[k][k] {
        sd if sd > 0.0 => {
            let [fitted, middle] = [explanation, &broad].map(|e| broad.coordinate(*index, e.values[*index]));
            (fitted - middle) / sd
        }
        _ => 0.0,
    };
    let fitted = broad.uncertain.iter().enumerate().map(xi).collect();
    let mut evidence = Evidence::starting_at(&broad, fitted);
    evidence.add_all(records)?;
    Ok(evidence.updated())
}

/// The explanation with a prior as wide as the bounds of each parameter, about their middle.
fn with_prior(e: &Explanation) -> Explanation {
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
    broad
}
