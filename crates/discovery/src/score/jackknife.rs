//! The block jackknife: how estimates move when blocks are left out, and how far they are from a value in the scatter of these moves
//! (formulas (1) and (3) of [`evidence`](super::evidence)).

use crate::linear::Square;

/// (1): how parameters move without a block of this curvature and gradient, where all blocks have the curvature `sum`.
pub(crate) fn move_without(sum: &Square, curvature: &Square, gradient: &[f64]) -> Vec<f64> {
    let rest = Square { n: sum.n, a: sum.a.iter().zip(&curvature.a).map(|(a, b)| a - b).collect() };
    let mut step: Vec<f64> = gradient.iter().map(|g| -g).collect();
    rest.cholesky().solve(&mut step);
    step
}

/// (3): covariance of some parameters by their moves, so many neighbouring blocks to each side taken together (Newey and West 1987).
pub(crate) fn covariance(moves: &[Vec<f64>], entries: &[usize], lags: usize) -> Square {
    let n = moves.len() as f64;
    let mean: Vec<f64> = entries.iter().map(|&i| moves.iter().map(|d| d[i]).sum::<f64>() / n).collect();
    let from_mean = |d: &Vec<f64>| entries.iter().zip(&mean).map(|(&i, mean)| d[i] - mean).collect();
    let off: Vec<Vec<f64>> = moves.iter().map(from_mean).collect();
    let mut out = Square::zero(entries.len());
    for lag in 0..=lags.min(off.len()) {
        let share = (n - 1.0) / n * (1.0 - lag as f64 / (lags + 1) as f64);
        for (later, earlier) in off[lag..].iter().zip(&off) {
            for (a, x) in later.iter().enumerate() {
                for (b, y) in earlier.iter().enumerate() {
                    *out.at_mut(a, b) += share * x * y;
                    if lag > 0 {
                        *out.at_mut(b, a) += share * x * y;
                    }
                }
            }
        }
    }
    out
}

/// Squared distance of some parameters from values that they are `off` by, in their covariance.
pub(crate) fn distance(moves: &[Vec<f64>], entries: &[usize], off: &[f64], lags: usize) -> f64 {
    let mut x = off.to_vec();
    covariance(moves, entries, lags).cholesky().forward(&mut x);
    x.iter().map(|v| v * v).sum()
}
