//! A transition model without process noise whose initial state is part of the latents.
//!
//! A ball on a grid of time steps touches the ground at this step or at the next. A Gaussian state that
//! covers both cases describes neither, and posteriors after it had errors of metres (one drop in a
//! thousand). With the initial state among the latents, like the restitution, each particle follows one
//! exact path.

use super::{Moments, StepLaw};
use crate::TrainerError;
use crate::latent::cholesky_into;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A model with S extra standard normal latents that determine the initial state.
/// Its latents `[L + S]` begin with those of `law`.
#[derive(Debug, Clone)]
pub(super) struct Started<L> {
    law: L,
    mean: Vec<f64>,
    factor: Vec<f64>,
    /// Latents of the inner model, `[lane, L]`.
    own: Vec<f64>,
}

impl<L: StepLaw> Started<L> {
    pub fn new(law: L) -> Self {
        let s = law.state_dim();
        Started { mean: vec![0.0; s], factor: vec![0.0; s * s], own: Vec::new(), law }
    }
}

impl<L: StepLaw> StepLaw for Started<L> {
    fn latent_dim(&self) -> usize {
        self.law.latent_dim() + self.law.state_dim()
    }

    fn state_dim(&self) -> usize {
        self.law.state_dim()
    }

    fn draw(&self, count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        let (l, s) = (self.law.latent_dim(), self.law.state_dim());
        let own = self.law.draw(count, rng);
        let mut all = Vec::with_capacity(count * (l + s));
        for k in 0..count {
            all.extend_from_slice(&own[k * l..(k + 1) * l]);
            all.extend((0..s).map(|_| -> f64 { StandardNormal.sample(rng) }));
        }
        all
    }

    fn log_density(&mut self, latent: &[f64]) -> f64 {
        let (own, start) = latent.split_at(self.law.latent_dim());
        self.law.log_density(own) - 0.5 * start.iter().map(|z| z * z).sum::<f64>()
    }

    fn resolution(&self, j: usize) -> f64 {
        self.law.resolution(j)
    }

    fn begin(&mut self, mean: &[f64], covariance: &[f64]) -> bool {
        self.mean.copy_from_slice(mean);
        self.factor.fill(0.0);
        cholesky_into(covariance, mean.len(), &mut self.factor);
        true
    }

    fn first(&self, latent: &[f64], state: &mut [f64]) {
        let (s, z) = (state.len(), &latent[self.law.latent_dim()..]);
        for (j, x) in state.iter_mut().enumerate() {
            *x = self.mean[j] + (0..=j).map(|k| self.factor[j * s + k] * z[k]).sum::<f64>();
        }
    }

    fn advance(
        &mut self,
        states: &[f64],
        latents: &[f64],
        actions: [&[f64]; 2],
        next: Moments<'_>,
    ) -> Result<(), TrainerError> {
        let (l, all) = (self.law.latent_dim(), self.latent_dim());
        self.own.clear();
        latents.chunks_exact(all).for_each(|latent| self.own.extend_from_slice(&latent[..l]));
        self.law.advance(states, &self.own, actions, next)
    }
}
