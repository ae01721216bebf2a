//! Gaussian states of many particles, propagated and updated together.

use super::moments::{Gaussian, cubature, measure};
use super::{Moments, Sensor, TransitionModel};
use crate::TrainerError;

/// Means `[n, S]` and covariances `[n, S, S]` of the states of n particles.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct States {
    pub mean: Vec<f64>,
    pub covariance: Vec<f64>,
}

impl States {
    /// Copies the states of all particles from `source`.
    pub fn copy_from(&mut self, source: &States) {
        self.mean.clone_from(&source.mean);
        self.covariance.clone_from(&source.covariance);
    }

    /// Copies the states of the particles `chosen` from `source`.
    pub fn select_from(&mut self, source: &States, chosen: &[usize], s: usize) {
        gather_rows(&source.mean, chosen, s, &mut self.mean);
        gather_rows(&source.covariance, chosen, s * s, &mut self.covariance);
    }

    /// Sets all `count` particles to one state.
    pub fn repeat(&mut self, state: &Gaussian, count: usize) {
        self.mean.clear();
        self.covariance.clear();
        for _ in 0..count {
            self.mean.extend_from_slice(&state.mean);
            self.covariance.extend_from_slice(&state.covariance);
        }
    }

    /// Copies the state of particle `i` from `source`.
    pub fn copy_one(&mut self, source: &States, i: usize, s: usize) {
        let (a, b) = (i * s..(i + 1) * s, i * s * s..(i + 1) * s * s);
        self.mean[a.clone()].copy_from_slice(&source.mean[a]);
        self.covariance[b.clone()].copy_from_slice(&source.covariance[b]);
    }
}

/// Writes the rows `chosen` of `values`, each of `width` values, to `out`.
pub(super) fn gather_rows(values: &[f64], chosen: &[usize], width: usize, out: &mut Vec<f64>) {
    out.clear();
    chosen.iter().for_each(|&i| out.extend_from_slice(&values[i * width..(i + 1) * width]));
}

/// Buffers for one step of all particles; nothing is allocated after the first step.
#[derive(Debug, Clone, Default)]
pub(super) struct Workspace {
    points: Vec<f64>,
    latents: Vec<f64>,
    mean: Vec<f64>,
    variance: Vec<f64>,
    factor: Vec<f64>,
}

impl Workspace {
    /// Propagates every state by one sample and updates it by `row` as measured by `sensor`.
    /// Propagation uses cubature points, or the mean alone where no state is uncertain. Adds the log
    /// density of the row given the rows before to `density [n]`.
    pub fn step(
        &mut self,
        model: &mut dyn TransitionModel,
        latents: &[f64],
        states: &mut States,
        actions: [&[f64]; 2],
        (row, sensor): (&[f64], &Sensor),
        density: &mut [f64],
    ) -> Result<(), TrainerError> {
        let (l, s) = (model.latent_dim(), model.state_dim());
        let n = density.len();
        let is_certain = states.covariance.iter().all(|v| *v == 0.0);
        let points_per_particle = if is_certain { 1 } else { 2 * s };
        self.points.resize(n * points_per_particle * s, 0.0);
        self.latents.clear();
        self.factor.resize(s * s, 0.0);
        for i in 0..n {
            let (mean, points) = (
                &states.mean[i * s..(i + 1) * s],
                &mut self.points[i * points_per_particle * s..(i + 1) * points_per_particle * s],
            );
            match is_certain {
                true => points.copy_from_slice(mean),
                false => {
                    let covariance = &states.covariance[i * s * s..(i + 1) * s * s];
                    cubature(mean, covariance, &mut self.factor, points);
                }
            }
            for _ in 0..points_per_particle {
                self.latents.extend_from_slice(&latents[i * l..(i + 1) * l]);
            }
        }
        self.mean.resize(n * points_per_particle * s, 0.0);
        self.variance.resize(n * points_per_particle * s, 0.0);
        let next = Moments { mean: &mut self.mean, variance: &mut self.variance };
        model.advance(&self.points, &self.latents, actions, next)?;
        for (i, density) in density.iter_mut().enumerate() {
            let lanes = i * points_per_particle * s..(i + 1) * points_per_particle * s;
            let (means, variances) = (&self.mean[lanes.clone()], &self.variance[lanes]);
            let mean = &mut states.mean[i * s..(i + 1) * s];
            let covariance = &mut states.covariance[i * s * s..(i + 1) * s * s];
            gather(means, variances, mean, covariance);
            for (j, variance) in sensor.observed_columns() {
                *density += measure(mean, covariance, j, row[j], variance);
            }
            if sensor.is_exact() {
                mean.copy_from_slice(row);
                covariance.fill(0.0);
            }
        }
        Ok(())
    }
}

/// Computes the mean and covariance of an equally weighted mixture of k Gaussians.
/// The components have means `means [k, S]` and diagonal covariances `variances [k, S]`.
fn gather(means: &[f64], variances: &[f64], mean: &mut [f64], covariance: &mut [f64]) {
    let s = mean.len();
    let k = (means.len() / s) as f64;
    mean.fill(0.0);
    covariance.fill(0.0);
    for point in means.chunks_exact(s) {
        mean.iter_mut().zip(point).for_each(|(m, v)| *m += v / k);
    }
    for (point, variance) in means.chunks_exact(s).zip(variances.chunks_exact(s)) {
        for a in 0..s {
            for b in 0..s {
                covariance[a * s + b] += (point[a] - mean[a]) * (point[b] - mean[b]) / k;
            }
            covariance[a * s + a] += variance[a] / k;
        }
    }
}
