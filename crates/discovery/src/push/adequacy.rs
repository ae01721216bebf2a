//! Whether the best model leaves anything.

use super::evaluate::Piece;
use super::fit::Fit;
use super::search::Search;
use crate::result::Tests;
use crate::statistics::{chi2_tail, median};

/// Relative standard error of the estimated noise variance: a misfit within it is no misfit.
const NOISE_UNCERTAINTY: f64 = 0.03;

/// Tests of a fit. `rejected` are kinds that were fitted beside it and did not pay: a score only forecasts what a fit settles.
/// Where the pushes scatter, `own` are the windows at the centres of their pushes: what is left there counts.
pub(crate) fn tests(search: &Search<'_>, fit: &Fit, rejected: &[&str], own: Option<&[Piece]>) -> Tests {
    let p = fit.theta.len();
    let pieces = own.unwrap_or(&fit.pieces);
    let mut ratios: Vec<f64> = pieces.iter().filter(|w| w.m > 3).map(|w| w.q / (w.m as f64 - 3.0)).collect();
    let freedom: f64 = pieces.iter().map(|w| w.m as f64 - 3.0).sum::<f64>().max(1.0);
    let excess = median(&mut ratios) - 1.0;
    let z = excess / (NOISE_UNCERTAINTY + (4.0 / freedom).sqrt());
    // chi2_1 of z is the two-sided normal tail.
    let lack_of_fit = if z > 0.0 { chi2_tail(z * z, 1.0) } else { 1.0 };

    let mut scores = search.scores(fit);
    scores.retain(|s| !rejected.contains(&s.kind));
    let m = scores.len().max(1) as f64;
    let library = scores
        .iter()
        .map(|s| {
            let (gain, k) = ((s.gain - search.resolution()).max(0.0), search.size(s.kind) as f64);
            m * chi2_tail(s.dispersion.narrowed(gain / s.dispersion.factor, k), k)
        })
        .fold(1.0, f64::min);

    // Kristensen and Madsen 2004: one step of each parameter, window by window.
    let mut heterogeneity: f64 = 1.0;
    for i in 0..p {
        let (mut q, mut uu, mut ss, mut n) = (0.0, 0.0, 0.0, 0.0);
        for w in pieces.iter().filter(|w| search.train.cost(w.q, w.m).1 == 1.0) {
            let (s, u) = w.reduced(w.g.len() - 3);
            if s.at(i, i) > 0.0 {
                q += u[i] * u[i] / s.at(i, i);
                uu += u[i];
                ss += s.at(i, i);
                n += 1.0;
            }
        }
        if n > 2.0 {
            let level = (1.0 + excess).max(1.0);
            heterogeneity = heterogeneity.min(p as f64 * chi2_tail((q - uu * uu / ss) / level, n - 1.0));
        }
    }
    let pass = lack_of_fit > 1e-4 && library > 1e-3 && heterogeneity > 1e-4;
    Tests { lack_of_fit, library, laws: None, heterogeneity, periodicity: None, pass }
}
