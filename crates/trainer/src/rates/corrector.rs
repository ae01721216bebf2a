//! Applies the corrections of Hybrid+ to several roll-outs at once.
//!
//! In units of the targets, the correction of a rate at interval n is
//!
//! ```text
//! (1)  gain mean_n + spread sd_n z_n,    z_n = k z_(n-1) + sqrt(1 - k^2) e_n,    k = exp(-1 / memory),
//! ```
//!
//! with mean and sd predicted by the net and e_n standard normal: first-order autoregressive noise with
//! unit variance, whose correlation time is `memory` intervals.

use super::features::{Trust, Units};
use crate::nets::{StepRunner, Stepwise};
use augsim_nn::Params;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A net with the latents and noise states of all lanes.
pub(crate) struct Corrector<'a> {
    runner: StepRunner,
    latents: Vec<f32>,
    /// Shrinkage factors of each lane, which multiply those of the units.
    trust: Vec<Trust>,
    units: Units<'a>,
    /// Autoregressive noise z of (1), `[D, lane]`; empty before the first interval.
    wandering: Vec<f64>,
    rng: Xoshiro256PlusPlus,
}

impl<'a> Corrector<'a> {
    /// Corrections of `net` in `trust.len()` lanes, with `latents [L, lane]`.
    pub fn new(
        (net, params): (&Stepwise, &Params<f32>),
        latents: Vec<f32>,
        trust: Vec<Trust>,
        units: Units<'a>,
        rng: Xoshiro256PlusPlus,
    ) -> Self {
        let runner = StepRunner::new(net, params, trust.len());
        Corrector { runner, latents, trust, units, wandering: Vec::new(), rng }
    }

    /// Draws the corrections of the rates `[D, lane]`, per second, for features `u [U, lane]`.
    pub fn draw(&mut self, u: &[f32], rates: &mut [f64]) {
        let (features, latents) = self.runner.input();
        features.copy_from_slice(u);
        latents.copy_from_slice(&self.latents);
        let (mean, sd) = self.runner.run();
        let lanes = self.trust.len();
        let begins = self.wandering.is_empty();
        self.wandering.resize(rates.len(), 0.0);
        for (i, (rate, wandering)) in rates.iter_mut().zip(&mut self.wandering).enumerate() {
            let (k, trust) = (i / lanes, self.trust[i % lanes]);
            let noise: f64 = StandardNormal.sample(&mut self.rng);
            let kept = if begins || trust.memory <= 0.0 { 0.0 } else { (-1.0 / trust.memory).exp() };
            *wandering = kept * *wandering + (1.0 - kept * kept).sqrt() * noise;
            *rate = trust.gain * self.units.mean[k] * f64::from(mean[i])
                + trust.spread * self.units.deviation[k] * f64::from(sd[i]) * *wandering;
        }
    }
}
