//! Normalisation and resampling of particle weights, and the effective sample size.

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Draws `count` particles in proportion to their weights by systematic resampling, into `chosen`.
/// `log` are log weights; `shares` is scratch.
pub(super) fn systematic_into(
    log: &[f64],
    count: usize,
    rng: &mut Xoshiro256PlusPlus,
    shares: &mut Vec<f64>,
    chosen: &mut Vec<usize>,
) {
    shares_into(log.iter().copied(), shares);
    let shift: f64 = rng.random();
    let (mut sum, mut i) = (shares[0], 0);
    chosen.clear();
    for k in 0..count {
        let at = (k as f64 + shift) / count as f64;
        while sum < at && i + 1 < shares.len() {
            i += 1;
            sum += shares[i];
        }
        chosen.push(i);
    }
}

/// Draws `count` particles in proportion to their weights by systematic resampling.
pub(super) fn systematic(log: &[f64], count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<usize> {
    let (mut shares, mut chosen) = (Vec::new(), Vec::with_capacity(count));
    systematic_into(log, count, rng, &mut shares, &mut chosen);
    chosen
}

/// Normalises log weights to weights with a sum of 1, into `shares`.
pub(super) fn shares_into(log: impl Iterator<Item = f64>, shares: &mut Vec<f64>) {
    shares.clear();
    shares.extend(log);
    let top = shares.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    shares.iter_mut().for_each(|w| *w = (*w - top).exp());
    let total: f64 = shares.iter().sum();
    shares.iter_mut().for_each(|w| *w /= total);
}

/// Normalises log weights to weights with a sum of 1.
pub(super) fn shares(log: &[f64]) -> Vec<f64> {
    let mut shares = Vec::with_capacity(log.len());
    shares_into(log.iter().copied(), &mut shares);
    shares
}

/// Effective sample size of log weights (Kong, Liu, Wong 1994); `shares` is scratch.
pub(super) fn effective_of(log: impl Iterator<Item = f64>, shares: &mut Vec<f64>) -> f64 {
    shares_into(log, shares);
    1.0 / shares.iter().map(|w| w * w).sum::<f64>()
}

/// Effective sample size of log weights.
pub(super) fn effective(log: &[f64]) -> f64 {
    effective_of(log.iter().copied(), &mut Vec::with_capacity(log.len()))
}
