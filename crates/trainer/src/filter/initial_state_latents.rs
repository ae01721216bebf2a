//! A transition model without process noise whose initial state is part of the latents.
//!
//! A ball on a grid of time steps touches the ground at this step or at the next. A Gaussian state that
//! covers both cases describes neither, and posteriors after it had errors of metres (one drop in a
//! thousand). With the initial state among the latents, like the restitution, each particle follows one
//! exact path.

use super::{Moments, TransitionModel};
use crate::TrainerError;
use crate::latent::cholesky_into;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A transition model with S extra standard normal latents, which determine the S-column initial state.
/// Its latents `[L + S]` begin with the L latents of the model `inner`.
#[derive(Debug, Clone)]
pub(super) struct WithInitialState<L> {
    inner: L,
    mean: Vec<f64>,
    factor: Vec<f64>,
    /// Latents of the model `inner`, `[lane, L]`.
    inner_latents: Vec<f64>,
}

impl<L: TransitionModel> WithInitialState<L> {
    pub fn new(inner: L) -> Self {
        let s = inner.state_dim();
        WithInitialState { mean: vec![0.0; s], factor: vec![0.0; s * s], inner_latents: Vec::new(), inner }
    }
}

impl<L: TransitionModel> TransitionModel for WithInitialState<L> {
    fn latent_dim(&self) -> usize {
        self.inner.latent_dim() + self.inner.state_dim()
    }

    fn state_dim(&self) -> usize {
        self.inner.state_dim()
    }

    fn draw(&self, count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        let (l, s) = (self.inner.latent_dim(), self.inner.state_dim());
        let inner_latents = self.inner.draw(count, rng);
        let mut latents = Vec::with_capacity(count * (l + s));
        for k in 0..count {
            latents.extend_from_slice(&inner_latents[k * l..(k + 1) * l]);
            latents.extend((0..s).map(|_| -> f64 { StandardNormal.sample(rng) }));
        }
        latents
    }

    fn log_density(&mut self, latent: &[f64]) -> f64 {
        let (inner_latents, start) = latent.split_at(self.inner.latent_dim());
        self.inner.log_density(inner_latents) - 0.5 * start.iter().map(|z| z * z).sum::<f64>()
    }

    fn resolution(&self, j: usize) -> f64 {
        self.inner.resolution(j)
    }

    fn set_initial_state(&mut self, mean: &[f64], covariance: &[f64]) -> bool {
        self.mean.copy_from_slice(mean);
        self.factor.fill(0.0);
        cholesky_into(covariance, mean.len(), &mut self.factor);
        true
    }

    fn initial_state(&self, latent: &[f64], state: &mut [f64]) {
        let (s, z) = (state.len(), &latent[self.inner.latent_dim()..]);
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
        let (l, width) = (self.inner.latent_dim(), self.latent_dim());
        self.inner_latents.clear();
        latents.chunks_exact(width).for_each(|latent| self.inner_latents.extend_from_slice(&latent[..l]));
        self.inner.advance(states, &self.inner_latents, actions, next)
    }
}
