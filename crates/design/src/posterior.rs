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
    // The fitted values in coordinates of the prior, whose factor is diagonal.
    let coordinate = |(k, index): (usize, &usize)| match broad.factor[k][k] {
        sd if sd > 0.0 => (explanation.values[*index] - broad.values[*index]) / sd,
        _ => 0.0,
    };
    let fitted = broad.uncertain.iter().enumerate().map(coordinate).collect();
    let mut evidence = Evidence::starting_at(&broad, fitted);
    evidence.add_all(records)?;
    Ok(evidence.updated())
}

/// The explanation with a prior as wide as the bounds of each parameter, about their middle.
fn with_prior(e: &Explanation) -> Explanation {
    let mut broad = e.clone();
    let count = e.uncertain.len();
    broad.factor = vec![vec![0.0; count]; count];
    for (k, (index, fitted_sd)) in e.uncertain.iter().zip(e.standard_deviations()).enumerate() {
        let p = &e.system.parameters()[*index];
        let width = (p.max - p.min) / 12.0_f64.sqrt();
        let most = PRIOR_ERRORS * fitted_sd;
        // Bounds far wider than the fit's error add nothing; a prior about the fitted value is then as good.
        if width.is_finite() && (width <= most || fitted_sd <= 0.0) {
            broad.values[*index] = 0.5 * (p.min + p.max);
            broad.factor[k][k] = width;
        } else {
            broad.factor[k][k] = most;
        }
    }
    broad
}
