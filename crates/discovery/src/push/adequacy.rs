//! Whether the best model leaves anything.

use super::evaluate::Piece;
use super::fit::Fit;
use super::search::Search;
use crate::result::Tests;
use crate::statistics::{chi2_tail, median};

/// Relative standard error of the estimated noise variance: a misfit within it is no misfit.
const NOISE_UNCERTAINTY: f64 = 0.03;

/// Most that one window may add to the difference of a parameter between windows: noise passes it once in a million windows. A
/// parameter that differs does so in many; a start that meets the rod bends the cost of one.
const MOST_OF_A_WINDOW: f64 = 23.9;

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

    // Kristensen and Madsen 2004: one step of each parameter, window by window, against the common step. The misfit that all
    // windows share is no difference between them, nor is what the noise's variance may be off by.
    let level = (1.0 + excess).max(1.0) + 2.0 * NOISE_UNCERTAINTY;
    let mut heterogeneity: f64 = 1.0;
    for i in 0..p {
        let steps: Vec<(f64, f64)> = pieces
            .iter()
            .filter(|w| search.train.cost(w.q, w.m).1 == 1.0)
            .filter_map(|w| {
                let (s, u) = w.reduced(w.g.len() - 3);
                (s.at(i, i) > 0.0).then(|| (s.at(i, i), u[i]))
            })
            .collect();
        if steps.len() > 2 {
            let (s, u) = steps.iter().fold((0.0, 0.0), |sum, w| (sum.0 + w.0, sum.1 + w.1));
            let apart = |(sw, uw): &(f64, f64)| (uw - sw * u / s).powi(2) / sw;
            let statistic: f64 = steps.iter().map(|w| apart(w).min(MOST_OF_A_WINDOW * level)).sum();
            let freedom = steps.len() as f64 - 1.0;
            heterogeneity = heterogeneity.min(p as f64 * chi2_tail(statistic / level, freedom));
        }
    }
    let heterogeneity = heterogeneity.min(1.0);
    let pass = lack_of_fit > 1e-4 && library > 1e-3 && heterogeneity > 1e-4;
    Tests { lack_of_fit, library, laws: None, heterogeneity, periodicity: None, pass }
}
