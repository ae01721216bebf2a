//! Choice of the window length.
//!
//! Longer windows have fewer initial states to estimate and determine slow parameters better, as long as the
//! model follows the data; beyond that, process noise and model errors accumulate along a window. The length
//! with the smallest scatter of the parameters over blocks is the best compromise.

use crate::calibrate::calibrate;
use crate::fit::{Fit, fit, fit_nuisance};
use crate::prepare::Prepared;
use crate::records::View;
use crate::score::{BLOCKS, Scored, entries_at_bounds};

/// Number of successive longer windows without improvement after which the trial of lengths ends.
const MAX_WORSE_LENGTHS: usize = 2;

/// Growth of the root mean square residual on doubling the window length above which the fit counts as
/// failed. A white force noise makes it grow by 2^1.5 = 2.8 in a position; faster growth is an instability or
/// a local minimum.
const MAX_RESIDUAL_GROWTH: f64 = 4.0;
/// Increase of the mean log variance for each parameter at a bound. It is larger than any difference of log
/// variances.
const BOUND_PENALTY: f64 = 1e3;

/// Calibrates the declared model over windows of the best length; returns the windows and the fit.
pub(crate) fn calibrate_windows(prepared: &Prepared, chosen: &[usize]) -> (View, Scored) {
    let view = View::new(prepared, chosen, 1);
    let fitted = calibrate(&view.sample());
    choose_window_length(prepared, chosen, view, fitted)
}

/// Refits a set over windows of the best length. `from` is its fit over the shortest windows, those of
/// `view`.
pub(crate) fn choose_window_length(
    prepared: &Prepared,
    chosen: &[usize],
    view: View,
    from: Fit,
) -> (View, Scored) {
    // Without states no initial states are estimated and nothing accumulates: all lengths are equally good.
    let is_stateless = from.hypothesis.system.schema().states.is_empty();
    let first = Scored::new(&view.sample(), &view.blocks, from);
    if is_stateless {
        return (view, first);
    }
    let mut trials = vec![(mean_log_variance(&first), view, first)];
    let mut worse_in_row = 0;
    for joined in View::lengths(prepared).into_iter().skip(1) {
        let view = View::new(prepared, chosen, joined);
        let before = &trials[trials.len() - 1].2.fit;
        let fitted = Scored::new(&view.sample(), &view.blocks, refit_on(&view, before));
        // A fit that the deadline cut short is no better than the one it started from.
        if prepared.clock.is_over()
            || is_fit_lost(&trials[trials.len() - 1].2, &fitted)
            || fitted.evidence.blocks_share_residuals()
        {
            break;
        }
        let mean_log_variance = mean_log_variance(&fitted);
        let least = trials.iter().map(|t| t.0).fold(f64::INFINITY, f64::min);
        worse_in_row = if mean_log_variance > least + log_variance_error() { worse_in_row + 1 } else { 0 };
        trials.push((mean_log_variance, view, fitted));
        if worse_in_row == MAX_WORSE_LENGTHS {
            break;
        }
    }
    let least = trials.iter().map(|t| t.0).fold(f64::INFINITY, f64::min);
    let best = trials.iter().rposition(|t| t.0 <= least + log_variance_error()).unwrap_or(0);
    let (_, view, fitted) = trials.swap_remove(best);
    (view, fitted)
}

/// Whether the residuals grow so much from the shorter to the longer windows that the fit has failed.
fn is_fit_lost(short: &Scored, long: &Scored) -> bool {
    let [short, long] = [short, long].map(|s| {
        let sums = s.fit.residual_norms.iter().fold([0.0, 0.0], |sum, [q, n]| [sum[0] + q, sum[1] + n]);
        sums[0] / sums[1].max(1.0)
    });
    long.is_nan() || long > MAX_RESIDUAL_GROWTH * MAX_RESIDUAL_GROWTH * short.max(1.0)
}

/// Refits a set over other windows, with initial states estimated again at the fitted parameters.
pub(crate) fn refit_on(view: &View, from: &Fit) -> Fit {
    let sample = view.sample();
    let starts = fit_nuisance(&sample, &from.hypothesis, &from.theta, &[]);
    fit(&sample, &from.hypothesis, &from.theta, &starts.nuisance)
}

/// One standard error of the difference of two mean log variances. A variance estimated with n degrees of
/// freedom has a log whose variance is 2/n.
fn log_variance_error() -> f64 {
    (2.0 / (BLOCKS - 1) as f64).sqrt()
}

/// Mean log variance of the parameters over blocks; infinite where the fit failed. Parameters at a bound have
/// no variance and add [`BOUND_PENALTY`] each.
fn mean_log_variance(scored: &Scored) -> f64 {
    if !scored.is_finite() {
        return f64::INFINITY;
    }
    let held = entries_at_bounds(&scored.fit);
    let free = (0..held.len()).filter(|i| !held[*i]);
    let logs: Vec<f64> = free.map(|i| scored.evidence.variance(i).max(f64::MIN_POSITIVE).ln()).collect();
    let at_bound = held.iter().filter(|h| **h).count() as f64;
    let mean = logs.iter().sum::<f64>() / logs.len().max(1) as f64 + BOUND_PENALTY * at_bound;
    if mean.is_nan() { f64::INFINITY } else { mean }
}
