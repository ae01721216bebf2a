//! The law of the trajectory latent over the training set (ex-post density estimation, Ghosh et al. 2020).

use crate::TrainerError;
use crate::in_order;
use crate::nets::Stepwise;
use crate::prepared::Prepared;
use augsim_nn::{Bound, Params};
use augsim_tensor::Tape;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A Gaussian fitted to what the encoder gave on the training set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LatentLaw {
    /// Mean, `[L]`.
    pub mean: Vec<f64>,
    /// Lower Cholesky factor of the covariance, `[L, L]`, row-major.
    pub factor: Vec<f64>,
}

impl LatentLaw {
    /// Matches mean and covariance of the mixture of all posteriors.
    pub(crate) fn fit(
        net: &Stepwise,
        params: &Params<f32>,
        train: &[Prepared],
    ) -> Result<Self, TrainerError> {
        let l = net.sizes().latent;
        let posteriors = in_order(train.par_iter().map(|p| infer(net, params, p)))?;
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
        Ok(LatentLaw { mean, factor: cholesky(&covariance, l) })
    }

    /// The latent `[L]` at standard normal `draws [L]`.
    pub(crate) fn place(&self, draws: &[f64]) -> Vec<f64> {
        let l = self.mean.len();
        let shift = |i: usize| (0..=i).map(|j| self.factor[i * l + j] * draws[j]).sum::<f64>();
        (0..l).map(|i| self.mean[i] + shift(i)).collect()
    }

    /// Logarithm of the density of a latent, less a constant; directions without variance do not count. `white [L]` is scratch.
    pub(crate) fn log_density(&self, latent: &[f64], white: &mut [f64]) -> f64 {
        whiten_into(latent, &self.mean, &self.factor, white);
        -0.5 * white.iter().map(|v| v * v).sum::<f64>()
    }

    /// Latents `[L, samples]` for standard normal `draws [L, samples]`.
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

/// Posterior mean and deviation of the latent of one trajectory, `[L]` each.
pub(crate) fn infer(
    net: &Stepwise,
    params: &Params<f32>,
    p: &Prepared,
) -> Result<(Vec<f64>, Vec<f64>), TrainerError> {
    let (mut tape, mut bound) = (Tape::new(), Bound::default());
    params.bind_frozen(&mut tape, &mut bound)?;
    let x = tape.constant(&[p.time, p.x_width, 1], &p.x)?;
    let u = tape.constant(&[p.time, p.u_width, 1], &p.u)?;
    let u = net.remember(&mut tape, &bound, u)?;
    let g = net.infer(&mut tape, &bound, x, u, None)?;
    let wide = |v| tape.value(v).iter().map(|v| f64::from(*v)).collect();
    Ok((wide(g.mean), wide(g.sd)))
}

/// Coordinates in which a Gaussian of a mean and a lower factor `[L, L]` is standard; 0 along directions without variance.
pub(crate) fn whiten(latent: &[f64], mean: &[f64], factor: &[f64]) -> Vec<f64> {
    let mut white = vec![0.0; latent.len()];
    whiten_into(latent, mean, factor, &mut white);
    white
}

/// Writes the coordinates that [`whiten`] gives to `white [L]`.
pub(crate) fn whiten_into(latent: &[f64], mean: &[f64], factor: &[f64], white: &mut [f64]) {
    let l = latent.len();
    for j in 0..l {
        let known: f64 = (0..j).map(|k| factor[j * l + k] * white[k]).sum();
        let scale = factor[j * l + j];
        white[j] = if scale > 0.0 { (latent[j] - mean[j] - known) / scale } else { 0.0 };
    }
}

/// Lower Cholesky factor of a small positive semi-definite matrix, row-major; a direction without variance
/// gets none.
pub(crate) fn cholesky(a: &[f64], n: usize) -> Vec<f64> {
    let mut l = vec![0.0; n * n];
    cholesky_into(a, n, &mut l);
    l
}

/// Writes the factor that [`cholesky`] gives to `l [n, n]`.
pub(crate) fn cholesky_into(a: &[f64], n: usize, l: &mut [f64]) {
    l.fill(0.0);
    for i in 0..n {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
            let rest = a[i * n + j] - dot;
            l[i * n + j] = if i == j {
                rest.max(0.0).sqrt()
            } else if l[j * n + j] > 0.0 {
                rest / l[j * n + j]
            } else {
                0.0
            };
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: draws have the fitted mean and covariance, also where one direction has no variance.
    use super::*;

    #[test]
    fn the_factor_reproduces_the_covariance() {
        for a in [[4.0, 1.2, 1.2, 2.0], [1.0, 2.0, 2.0, 4.0], [0.0, 0.0, 0.0, 3.0]] {
            let l = cholesky(&a, 2);
            for i in 0..2 {
                for j in 0..2 {
                    let back: f64 = (0..2).map(|k| l[i * 2 + k] * l[j * 2 + k]).sum();
                    assert!((back - a[i * 2 + j]).abs() < 1e-12, "{a:?}: {l:?}");
                }
            }
        }
    }

    #[test]
    fn draws_are_shifted_and_mixed() {
        let law = LatentLaw { mean: vec![1.0, -1.0], factor: vec![2.0, 0.0, 0.5, 3.0] };
        assert_eq!(law.draw(&[1.0, 0.0, 0.0, 1.0], 2), [3.0, 1.0, -0.5, 2.0]);
    }
}
