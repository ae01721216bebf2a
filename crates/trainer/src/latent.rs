//! Gaussian distribution of the trajectory latent, from which forecasts draw.
//!
//! It is fitted to the encoder's posteriors on the training set (ex-post density estimation, Ghosh et al.
//! 2020).

use crate::TrainerError;
use crate::collect_in_order;
use crate::nets::Stepwise;
use crate::prepared::Prepared;
use augsim_nn::{Bound, Params};
use augsim_tensor::Tape;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Gaussian distribution of the trajectory latent, fitted to the encoder's posteriors on the training set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LatentDistribution {
    /// Mean of the latent, `[L]`.
    pub mean: Vec<f64>,
    /// Lower Cholesky factor of the latent's covariance, `[L, L]`, row-major.
    pub factor: Vec<f64>,
}

impl LatentDistribution {
    /// Fits mean and covariance of the mixture of all posteriors N(m_n, diag(sd_n^2)):
    /// mean = avg m_n, covariance = avg [(m_n - mean)(m_n - mean)' + diag(sd_n^2)].
    ///
    /// # Errors
    /// [`TrainerError`] if the encoder cannot be run on a trajectory.
    pub(crate) fn fit(
        net: &Stepwise,
        params: &Params<f32>,
        train: &[Prepared],
    ) -> Result<Self, TrainerError> {
        let l = net.sizes().latent;
        let posteriors = collect_in_order(train.par_iter().map(|p| encode(net, params, p)))?;
        let n = posteriors.len() as f64;
        let mean: Vec<f64> = (0..l).map(|i| posteriors.iter().map(|p| p.0[i]).sum::<f64>() / n).collect();
        let mut covariance = vec![0.0; l * l];
        for (m, sd) in &posteriors {
            for i in 0..l {
                for j in 0..l {
                    covariance[i * l + j] += (m[i] - mean[i]) * (m[j] - mean[j]) / n;
                }
                covariance[i * l + i] += sd[i] * sd[i] / n;
            }
        }
        Ok(LatentDistribution { mean, factor: cholesky(&covariance, l) })
    }

    /// Maps standard normal `draws [L]` to a latent `[L]`: mean + factor * draws, L the size of the latent.
    pub(crate) fn scale_standard_draws(&self, draws: &[f64]) -> Vec<f64> {
        let l = self.mean.len();
        let shift = |i: usize| (0..=i).map(|j| self.factor[i * l + j] * draws[j]).sum::<f64>();
        (0..l).map(|i| self.mean[i] + shift(i)).collect()
    }

    /// Log-density of a latent up to a constant; directions without variance do not count.
    ///
    /// `white [L]` is scratch.
    pub(crate) fn log_density(&self, latent: &[f64], white: &mut [f64]) -> f64 {
        whiten_into(latent, &self.mean, &self.factor, white);
        -0.5 * white.iter().map(|v| v * v).sum::<f64>()
    }

    /// Maps standard normal `draws [L, samples]` to latents `[L, samples]`, L the size of the latent.
    pub(crate) fn draw(&self, draws: &[f32], samples: usize) -> Vec<f32> {
        let l = self.mean.len();
        let mut w = vec![0.0; l * samples];
        for (i, row) in w.chunks_exact_mut(samples).enumerate() {
            for (sample, w) in row.iter_mut().enumerate() {
                let shift: f64 =
                    (0..=i).map(|j| self.factor[i * l + j] * f64::from(draws[j * samples + sample])).sum();
                *w = (self.mean[i] + shift) as f32;
            }
        }
        w
    }
}

/// Encodes one trajectory: posterior mean and standard deviation of its latent, `[L]` each.
pub(crate) fn encode(
    net: &Stepwise,
    params: &Params<f32>,
    p: &Prepared,
) -> Result<(Vec<f64>, Vec<f64>), TrainerError> {
    let (mut tape, mut bound) = (Tape::new(), Bound::default());
    params.bind_frozen(&mut tape, &mut bound)?;
    let x = tape.constant(&[p.time, p.x_width, 1], &p.x)?;
    let u = tape.constant(&[p.time, p.u_width, 1], &p.u)?;
    let u = net.read_features(&mut tape, &bound, u)?;
    let g = net.infer_latent(&mut tape, &bound, x, u, None)?;
    let to_f64 = |v| tape.value(v).iter().map(|v| f64::from(*v)).collect();
    Ok((to_f64(g.mean), to_f64(g.sd)))
}

/// Solves factor * white = latent - mean for `white`, with a lower-triangular factor `[L, L]`.
///
/// Entries of `white` along directions without variance are 0.
pub(crate) fn whiten(latent: &[f64], mean: &[f64], factor: &[f64]) -> Vec<f64> {
    let mut white = vec![0.0; latent.len()];
    whiten_into(latent, mean, factor, &mut white);
    white
}

/// Solves factor * white = latent - mean as [`whiten`] does, and writes the result to `white [L]`.
pub(crate) fn whiten_into(latent: &[f64], mean: &[f64], factor: &[f64], white: &mut [f64]) {
    let l = latent.len();
    for j in 0..l {
        let known: f64 = (0..j).map(|k| factor[j * l + k] * white[k]).sum();
        let diagonal = factor[j * l + j];
        white[j] = if diagonal > 0.0 { (latent[j] - mean[j] - known) / diagonal } else { 0.0 };
    }
}

/// Computes the lower Cholesky factor of a positive semi-definite matrix, row-major.
///
/// A column whose pivot is not positive (a direction without variance) is set to 0 instead of failing.
pub(crate) fn cholesky(a: &[f64], n: usize) -> Vec<f64> {
    let mut l = vec![0.0; n * n];
    cholesky_into(a, n, &mut l);
    l
}

/// Writes the lower Cholesky factor of `a [n, n]` to `l [n, n]`, as [`cholesky`] does.
pub(crate) fn cholesky_into(a: &[f64], n: usize, l: &mut [f64]) {
    l.fill(0.0);
    for i in 0..n {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
            let remainder = a[i * n + j] - dot;
            l[i * n + j] = if i == j {
                remainder.max(0.0).sqrt()
            } else if l[j * n + j] > 0.0 {
                remainder / l[j * n + j]
            } else {
                0.0
            };
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the factor reproduces the covariance, and draws are mean plus factor times noise.
    use super::*;

    #[test]
    fn the_factor_reproduces_the_covariance() {
        for a in [[4.0, 1.2, 1.2, 2.0], [1.0, 2.0, 2.0, 4.0], [0.0, 0.0, 0.0, 3.0]] {
            let l = cholesky(&a, 2);
            for i in 0..2 {
                for j in 0..2 {
                    let product: f64 = (0..2).map(|k| l[i * 2 + k] * l[j * 2 + k]).sum();
                    assert!((product - a[i * 2 + j]).abs() < 1e-12, "{a:?}: {l:?}");
                }
            }
        }
    }

    #[test]
    fn draws_are_the_mean_plus_the_factor_times_noise() {
        let distribution = LatentDistribution { mean: vec![1.0, -1.0], factor: vec![2.0, 0.0, 0.5, 3.0] };
        assert_eq!(distribution.draw(&[1.0, 0.0, 0.0, 1.0], 2), [3.0, 1.0, -0.5, 2.0]);
    }
}
