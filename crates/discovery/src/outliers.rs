//! Windows that no model follows.

use crate::fit::Fit;
use crate::statistics::median;

/// Misfit of a window, in units of the typical one, beyond which it counts as left out: three standard deviations.
const BEYOND: f64 = 9.0;

/// Mean squared residual, in units of the noise, beyond which a window counts as left out, by what is typical of a fit.
pub(crate) fn limit(best: &Fit) -> f64 {
    let mut ratios: Vec<f64> = best.misfits.iter().map(|[misfit, freedom]| misfit / freedom).collect();
    BEYOND * median(&mut ratios).max(1.0)
}

/// Which windows both the calibrated and the best model miss by more than `limit`. Fits give them little weight already;
/// here they are counted, and are not forecast.
pub(crate) fn left_out(limit: f64, fits: [&Fit; 2]) -> Vec<bool> {
    let [base, best] = fits.map(|fit| &fit.misfits);
    let beyond = |[misfit, freedom]: &[f64; 2]| misfit > &(limit * freedom);
    base.iter().zip(best).map(|(a, b)| beyond(a) && beyond(b)).collect()
}
