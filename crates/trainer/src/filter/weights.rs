//! Log weights of particles: shares, effective number, resampling.

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Particles in proportion to their weights (systematic resampling).
pub(super) fn systematic(log: &[f64], count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<usize> {
    let weights = shares(log);
    let shift: f64 = rng.random();
    let (mut chosen, mut sum, mut i) = (Vec::with_capacity(count), weights[0], 0);
    for k in 0..count {
        let at = (k as f64 + shift) / count as f64;
        while sum < at && i + 1 < weights.len() {
            i += 1;
            sum += weights[i];
        }
        chosen.push(i);
    }
    chosen
}

/// Weights of a sum of 1 from their logarithms.
pub(super) fn shares(log: &[f64]) -> Vec<f64> {
    let top = log.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = log.iter().map(|w| (w - top).exp()).collect();
    let total: f64 = weights.iter().sum();
    weights.into_iter().map(|w| w / total).collect()
}

/// Effective number of particles (Kong, Liu, Wong 1994).
pub(super) fn effective(log: &[f64]) -> f64 {
    1.0 / shares(log).iter().map(|w| w * w).sum::<f64>()
}
