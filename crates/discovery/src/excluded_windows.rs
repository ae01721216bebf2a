//! Windows that no model fits.

use crate::fit::Fit;
use crate::statistics::median;

/// Ratio of a window's mean squared residual to the typical one beyond which it is excluded: three standard
/// deviations.
const EXCLUDED_RATIO: f64 = 9.0;

/// Mean squared residual, in units of the noise, beyond which a window is excluded.
pub(crate) fn limit(best: &Fit) -> f64 {
    let mut ratios: Vec<f64> = best.misfits.iter().map(|[misfit, freedom]| misfit / freedom).collect();
    EXCLUDED_RATIO * median(&mut ratios).max(1.0)
}

/// Marks the windows that neither the calibrated nor the best model fits within `limit`. Fits give them
/// little weight already; they are counted, and excluded from the predictions.
pub(crate) fn left_out(limit: f64, fits: [&Fit; 2]) -> Vec<bool> {
    let [base, best] = fits.map(|fit| &fit.misfits);
    let beyond = |[misfit, freedom]: &[f64; 2]| misfit > &(limit * freedom);
    base.iter().zip(best).map(|(a, b)| beyond(a) && beyond(b)).collect()
}
