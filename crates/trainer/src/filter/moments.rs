//! Gaussian moments in a few dimensions: Kalman updates, cubature points, weighted mean and covariance.

use crate::latent::cholesky_into;

/// Mean `[S]` and covariance `[S, S]` of a state with S columns.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Gaussian {
    pub mean: Vec<f64>,
    pub covariance: Vec<f64>,
}

impl Gaussian {
    /// Creates a Gaussian with a diagonal covariance.
    pub fn diagonal(mean: &[f64], sd: &[f64]) -> Self {
        let s = mean.len();
        let mut covariance = vec![0.0; s * s];
        for (j, sd) in sd.iter().enumerate() {
            covariance[j * s + j] = sd * sd;
        }
        Gaussian { mean: mean.to_vec(), covariance }
    }

    /// Kalman update by a measurement of column `j`; returns its log density, up to a constant.
    pub fn measure(&mut self, j: usize, value: f64, variance: f64) -> f64 {
        measure(&mut self.mean, &mut self.covariance, j, value, variance)
    }
}

/// Kalman update of a mean `[S]` and covariance `[S, S]` by a measurement of column `j`.
/// Returns the log density of the measurement, up to a constant.
pub(super) fn measure(mean: &mut [f64], covariance: &mut [f64], j: usize, value: f64, variance: f64) -> f64 {
    let s = mean.len();
    let total = covariance[j * s + j] + variance;
    let innovation = value - mean[j];
    for a in 0..s {
        mean[a] += covariance[a * s + j] / total * innovation;
    }
    // Row j is read for every other element, so it is changed last.
    for a in (0..s).filter(|a| *a != j) {
        let gain = covariance[a * s + j] / total;
        for b in 0..s {
            if b != j {
                covariance[a * s + b] -= gain * covariance[j * s + b];
            }
        }
    }
    // Joseph's form for row and column j, P_jb R / (P_jj + R): the diagonal cannot become negative.
    for b in 0..s {
        let scaled = covariance[j * s + b] * variance / total;
        covariance[j * s + b] = scaled;
        covariance[b * s + j] = scaled;
    }
    -0.5 * (total.ln() + innovation * innovation / total)
}

/// Computes the 2 S points of the spherical cubature rule, `[2 S, S]` (Arasaratnam and Haykin 2009).
/// They are the mean plus and minus sqrt(S) times the columns of the Cholesky factor of the covariance.
/// Written to `out`; `factor [S, S]` is scratch.
pub(super) fn cubature(mean: &[f64], covariance: &[f64], factor: &mut [f64], out: &mut [f64]) {
    let s = mean.len();
    cholesky_into(covariance, s, factor);
    let root = (s as f64).sqrt();
    for k in 0..s {
        for j in 0..s {
            let shift = root * factor[j * s + k];
            out[k * s + j] = mean[j] + shift;
            out[(s + k) * s + j] = mean[j] - shift;
        }
    }
}

/// Computes the weighted mean and covariance of rows `[n, dim]`.
pub(super) fn weighted(rows: &[f64], weights: &[f64], dim: usize) -> Gaussian {
    let mut out = Gaussian { mean: Vec::new(), covariance: Vec::new() };
    weighted_into(rows, |i| weights[i], weights.iter().sum(), dim, &mut out);
    out
}

/// Computes the weighted mean and covariance of rows `[n, dim]` as [`weighted`], into `out`.
/// `weight` is a function of the row's index, and `total` the sum of the weights.
pub(super) fn weighted_into(
    rows: &[f64],
    weight: impl Fn(usize) -> f64,
    total: f64,
    dim: usize,
    out: &mut Gaussian,
) {
    let Gaussian { mean, covariance } = out;
    mean.clear();
    mean.resize(dim, 0.0);
    for (k, row) in rows.chunks_exact(dim).enumerate() {
        mean.iter_mut().zip(row).for_each(|(m, v)| *m += weight(k) / total * v);
    }
    covariance.clear();
    covariance.resize(dim * dim, 0.0);
    for (k, row) in rows.chunks_exact(dim).enumerate() {
        for i in 0..dim {
            for j in 0..dim {
                covariance[i * dim + j] += weight(k) / total * (row[i] - mean[i]) * (row[j] - mean[j]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: updates and cubature points agree with closed forms.
    use super::*;

    #[test]
    fn measuring_gives_the_conditional_gaussian() {
        // Covariance [[2, 1], [1, 3]], a measurement 1 of the first column with variance 2: gain [1/2,
        // 1/4].
        let mut g = Gaussian { mean: vec![0.0, 1.0], covariance: vec![2.0, 1.0, 1.0, 3.0] };
        let density = g.measure(0, 1.0, 2.0);
        assert!((density + 0.5 * (4.0_f64.ln() + 0.25)).abs() < 1e-14);
        for (actual, expected) in g.mean.iter().zip([0.5, 1.25]) {
            assert!((actual - expected).abs() < 1e-14);
        }
        for (actual, expected) in g.covariance.iter().zip([1.0, 0.5, 0.5, 2.75]) {
            assert!((actual - expected).abs() < 1e-14, "{:?}", g.covariance);
        }
    }

    #[test]
    fn cubature_points_reproduce_mean_and_covariance() {
        let (mean, covariance) = ([1.0, -2.0], [2.0, 1.0, 1.0, 3.0]);
        let mut points = [0.0; 8];
        cubature(&mean, &covariance, &mut [0.0; 4], &mut points);
        let back = weighted(&points, &[1.0; 4], 2);
        for (a, b) in back.mean.iter().zip(mean).chain(back.covariance.iter().zip(covariance)) {
            assert!((a - b).abs() < 1e-14, "{back:?}");
        }
    }
}
