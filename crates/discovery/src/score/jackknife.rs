//! The block jackknife: how estimates move when blocks are left out, and the covariance from these moves
//! (formulas (1) and (3) of [`evidence`](super::evidence)).

use crate::linear::{Square, dot};

/// Weight of the null value in leave-one-out estimates, as a share of the parameter's information. An effect
/// without support in the other blocks then vanishes there. It is above rounding, and below the share (1e-13)
/// from which on a direction counts as informative, so that no informed estimate is affected.
const NULL_WEIGHT: f64 = 1e-14;

/// Step of the parameters, formula (1), when a block with this curvature and gradient is left out. `sum` is
/// the curvature of all blocks. A parameter that no other block informs returns to its null value, from which
/// it differs by `off`; otherwise an effect in one block would be judged by its own fit.
pub(crate) fn step_without_block(
    sum: &Square,
    curvature: &Square,
    gradient: &[f64],
    off: &[f64],
) -> Vec<f64> {
    let mut others = sum.minus(curvature);
    let mut step: Vec<f64> = gradient.iter().map(|g| -g).collect();
    for (i, off) in off.iter().enumerate() {
        let ridge = NULL_WEIGHT * sum.at(i, i);
        *others.at_mut(i, i) += ridge;
        step[i] -= ridge * off;
    }
    others.cholesky().solve(&mut step);
    step
}

/// Weight of products of neighbours that are `lag` apart, of up to `lags` (Newey and West 1987).
pub(crate) fn lag_weight(lag: usize, lags: usize) -> f64 {
    1.0 - lag as f64 / (lags + 1) as f64
}

/// Covariance of the parameters `entries`, formula (3), from the leave-one-out steps `moves`, with products
/// of up to `lags` neighbouring blocks to each side (Newey and West 1987).
pub(crate) fn covariance(moves: &[Vec<f64>], entries: &[usize], lags: usize) -> Square {
    let n = moves.len() as f64;
    let mean: Vec<f64> = entries.iter().map(|&i| moves.iter().map(|d| d[i]).sum::<f64>() / n).collect();
    let from_mean = |d: &Vec<f64>| entries.iter().zip(&mean).map(|(&i, mean)| d[i] - mean).collect();
    let deviations: Vec<Vec<f64>> = moves.iter().map(from_mean).collect();
    let mut out = Square::zero(entries.len());
    for lag in 0..=lags.min(deviations.len()) {
        let share = (n - 1.0) / n * lag_weight(lag, lags);
        for (later, earlier) in deviations[lag..].iter().zip(&deviations) {
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

/// Effective degrees of freedom of the jackknife covariance of parameters (3), less one (Satterthwaite 1946;
/// Bell and McCaffrey 2002): `(sum v)^2 / sum v^2 - 1`, with `v` the share of each block in the variance that
/// independent residuals would give.
pub(crate) fn freedom<'a>(
    sum: &Square,
    curvatures: impl Iterator<Item = &'a Square>,
    entries: &[usize],
) -> f64 {
    let factor = sum.cholesky();
    let column = |&entry: &usize| -> Vec<f64> {
        let mut x: Vec<f64> = (0..sum.n).map(|i| f64::from(u8::from(i == entry))).collect();
        factor.solve(&mut x);
        x
    };
    let columns: Vec<Vec<f64>> = entries.iter().map(column).collect();
    let mut variance = Square::zero(entries.len());
    for (a, x) in columns.iter().enumerate() {
        entries.iter().enumerate().for_each(|(b, &entry)| *variance.at_mut(a, b) = x[entry]);
    }
    let variance = variance.cholesky();
    // Trace of a block's part of the variance in units of the whole.
    let share = |h: &Square| -> f64 {
        let parts = columns.iter().enumerate().map(|(a, x)| {
            let hx: Vec<f64> = h.a.chunks_exact(h.n).map(|row| dot(row, x)).collect();
            let mut part: Vec<f64> = columns.iter().map(|y| dot(&hx, y)).collect();
            variance.solve(&mut part);
            part[a]
        });
        parts.sum::<f64>().max(0.0)
    };
    let (sum, squares) = curvatures.map(share).fold((0.0, 0.0), |(s, q), v| (s + v, q + v * v));
    if squares > 0.0 { sum * sum / squares - 1.0 } else { 0.0 }
}

/// Squared distance of the parameters `entries` from values that they differ from by `off`, in their
/// covariance (3).
pub(crate) fn distance(moves: &[Vec<f64>], entries: &[usize], off: &[f64], lags: usize) -> f64 {
    let mut x = off.to_vec();
    covariance(moves, entries, lags).cholesky().forward(&mut x);
    x.iter().map(|v| v * v).sum()
}
