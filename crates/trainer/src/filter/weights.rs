//! Normalises and resamples particle weights, and computes the effective sample size.

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Draws `count` particles by systematic resampling, in proportion to their weights, into `chosen`.
/// `log` are log weights; `shares` is scratch.
pub(super) fn resample_into(
    log: &[f64],
    count: usize,
    rng: &mut Xoshiro256PlusPlus,
    shares: &mut Vec<f64>,
    chosen: &mut Vec<usize>,
) {
    normalise_into(log.iter().copied(), shares);
    let shift: f64 = rng.random();
    let (mut sum, mut i) = (shares[0], 0);
    chosen.clear();
    for k in 0..count {
        let position = (k as f64 + shift) / count as f64;
        while sum < position && i + 1 < shares.len() {
            i += 1;
            sum += shares[i];
        }
        chosen.push(i);
    }
}

/// Draws `count` particles by systematic resampling, in proportion to their weights; returns their indices.
pub(super) fn resample(log: &[f64], count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<usize> {
    let (mut shares, mut chosen) = (Vec::new(), Vec::with_capacity(count));
    resample_into(log, count, rng, &mut shares, &mut chosen);
    chosen
}

/// Converts log weights to weights with a sum of 1, written to `shares`.
pub(super) fn normalise_into(log: impl Iterator<Item = f64>, shares: &mut Vec<f64>) {
    shares.clear();
    shares.extend(log);
    let max = shares.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    shares.iter_mut().for_each(|w| *w = (*w - max).exp());
    let total: f64 = shares.iter().sum();
    shares.iter_mut().for_each(|w| *w /= total);
}

/// Converts log weights to weights with a sum of 1.
pub(super) fn shares(log: &[f64]) -> Vec<f64> {
    let mut shares = Vec::with_capacity(log.len());
    normalise_into(log.iter().copied(), &mut shares);
    shares
}

/// Effective sample size of log weights (Kong, Liu, Wong 1994); `shares` is scratch.
pub(super) fn effective_size_into(log: impl Iterator<Item = f64>, shares: &mut Vec<f64>) -> f64 {
    normalise_into(log, shares);
    1.0 / shares.iter().map(|w| w * w).sum::<f64>()
}

/// Finds the largest tempering increment, at most `remaining`, that leaves `enough` effective particles.
/// `effective_size_after` gives their number after an increment; the increment is found by bisection.
pub(super) fn largest_increment(
    mut effective_size_after: impl FnMut(f64) -> f64,
    remaining: f64,
    enough: f64,
) -> f64 {
    if effective_size_after(remaining) >= enough {
        return remaining;
    }
    let (mut low, mut high) = (0.0, remaining);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if effective_size_after(middle) >= enough { low = middle } else { high = middle }
    }
    low
}

/// Computes the effective sample size of log weights.
pub(super) fn effective_size(log: &[f64]) -> f64 {
    effective_size_into(log.iter().copied(), &mut Vec::with_capacity(log.len()))
}
