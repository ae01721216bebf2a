//! How long the windows of a fit are.
//!
//! A longer window has fewer starts to fit and tells slow parameters better, while the model follows the data; where it does not, errors
//! of the motion pile up along a window and its residuals say less. The length at which the parameters vary least over left-out blocks is
//! neither too short nor too long.

use crate::calibrate::calibrate;
use crate::fit::{Fit, fit, fit_nuisance};
use crate::prepare::Prepared;
use crate::records::View;
use crate::score::{BLOCKS, Scored, held};

/// Longer windows in a row that are worse before no longer ones are tried.
const LOSING: usize = 2;

/// Growth of the misfit, root mean square, from one length to its double beyond which a fit is lost. White noise of a force makes it grow by
/// 2^1.5 = 2.8 in a position; what grows faster is an instability or a wrong turn.
const LOST: f64 = 4.0;
/// Amount that a parameter at a bound adds to a mean logarithm of variances: more than any two differ by.
const AT_A_BOUND: f64 = 1e3;

/// The declared model, fitted over windows of the best length, and these windows.
pub(crate) fn calibrated(prepared: &Prepared, chosen: &[usize]) -> (View, Scored) {
    let view = View::new(prepared, chosen, 1);
    let fitted = calibrate(&view.sample());
    lengthened(prepared, chosen, view, fitted)
}

/// A fitted set over windows of the best length: `from` is its fit over the windows of `view`, the shortest.
pub(crate) fn lengthened(prepared: &Prepared, chosen: &[usize], view: View, from: Fit) -> (View, Scored) {
    let first = Scored::new(&view.sample(), &view.blocks, from);
    let mut tried = vec![(volume(&first), view, first)];
    let mut losing = 0;
    for joined in View::lengths(prepared).into_iter().skip(1) {
        let view = View::new(prepared, chosen, joined);
        let before = &tried[tried.len() - 1].2.fit;
        let fitted = Scored::new(&view.sample(), &view.blocks, refitted(&view, before));
        if follows_no_longer(&tried[tried.len() - 1].2, &fitted) || fitted.evidence.blocks_share_residuals() {
            break;
        }
        let volume = volume(&fitted);
        let least = tried.iter().map(|t| t.0).fold(f64::INFINITY, f64::min);
        losing = if volume > least + indistinct() { losing + 1 } else { 0 };
        tried.push((volume, view, fitted));
        if losing == LOSING {
            break;
        }
    }
    let least = tried.iter().map(|t| t.0).fold(f64::INFINITY, f64::min);
    let best = tried.iter().rposition(|t| t.0 <= least + indistinct()).unwrap_or(0);
    let (_, view, fitted) = tried.swap_remove(best);
    (view, fitted)
}

/// Whether the misfit grows from one length to its double by so much that the model does not follow the data over the longer windows.
fn follows_no_longer(short: &Scored, long: &Scored) -> bool {
    let [short, long] = [short, long].map(|s| {
        let sums = s.fit.misfits.iter().fold([0.0, 0.0], |sum, [q, n]| [sum[0] + q, sum[1] + n]);
        sums[0] / sums[1].max(1.0)
    });
    long.is_nan() || long > LOST * LOST * short.max(1.0)
}

/// A set over other windows, from starts that are found anew at the parameters that it had.
pub(crate) fn refitted(view: &View, from: &Fit) -> Fit {
    let sample = view.sample();
    let starts = fit_nuisance(&sample, &from.hypothesis, &from.theta, &[]);
    fit(&sample, &from.hypothesis, &from.theta, &starts.nuisance)
}

/// Difference of two mean logarithms of variances, each from the scatter over blocks, that is one standard error: the logarithm of a
/// variance with n degrees of freedom has the variance 2 / n.
fn indistinct() -> f64 {
    (2.0 / (BLOCKS - 1) as f64).sqrt()
}

/// Mean logarithm of the variances of the parameters; infinite where a fit is lost, and beyond all that moves where more of them stand at a
/// bound, of which nothing is known.
fn volume(scored: &Scored) -> f64 {
    if !scored.is_finite() {
        return f64::INFINITY;
    }
    let held = held(&scored.fit);
    let moving = (0..held.len()).filter(|i| !held[*i]);
    let logs: Vec<f64> = moving.map(|i| scored.evidence.variance(i).max(f64::MIN_POSITIVE).ln()).collect();
    let stuck = held.iter().filter(|h| **h).count() as f64;
    let mean = logs.iter().sum::<f64>() / logs.len().max(1) as f64 + AT_A_BOUND * stuck;
    if mean.is_nan() { f64::INFINITY } else { mean }
}
