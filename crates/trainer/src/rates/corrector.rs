//! Applies the corrections of Hybrid+ to several roll-outs at once.
//!
//! In units of the targets, the correction of a rate at interval n is
//!
//! ```text
//! (1)  gain mean_n + spread sd_n z_n,    z_n = k z_(n-1) + sqrt(1 - k^2) e_n,    k = exp(-1 / memory),
//! ```
//!
//! with mean and sd predicted by the net and e_n standard normal: first-order autoregressive noise with
//! unit variance, whose correlation time is `correlation_intervals` intervals.

use super::features::{CorrectionShrinkage, Units};
use crate::nets::{StepRunner, Stepwise};
use augsim_nn::Params;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Draws a net's corrections of the rates, with the latent and noise state of every lane (roll-out).
pub(crate) struct Corrector<'a> {
    runner: StepRunner,
    latents: Vec<f32>,
    /// Shrinkage factors of each lane (roll-out), which multiply those of the units.
    shrinkage: Vec<CorrectionShrinkage>,
    units: Units<'a>,
    /// Autoregressive noise z of formula (1), `[D, lane]` for D corrected rates; empty before the first interval.
    noise_state: Vec<f64>,
    rng: Xoshiro256PlusPlus,
}

impl<'a> Corrector<'a> {
    /// Creates a corrector with `net`, one lane per entry of `shrinkage`, and latents `[L, lane]`.
    pub fn new(
        (net, params): (&Stepwise, &Params<f32>),
        latents: Vec<f32>,
        shrinkage: Vec<CorrectionShrinkage>,
        units: Units<'a>,
        rng: Xoshiro256PlusPlus,
    ) -> Self {
        let runner = StepRunner::new(net, params, shrinkage.len());
        Corrector { runner, latents, shrinkage, units, noise_state: Vec::new(), rng }
    }

    /// Draws the corrections of D rates, `[D, lane]` per second, for the net's features `u [U, lane]`.
    pub fn draw(&mut self, u: &[f32], rates: &mut [f64]) {
        let (features, latents) = self.runner.input();
        features.copy_from_slice(u);
        latents.copy_from_slice(&self.latents);
        let (mean, sd) = self.runner.run();
        let lanes = self.shrinkage.len();
        let is_first_interval = self.noise_state.is_empty();
        self.noise_state.resize(rates.len(), 0.0);
        for (i, (rate, noise_state)) in rates.iter_mut().zip(&mut self.noise_state).enumerate() {
            let (k, shrinkage) = (i / lanes, self.shrinkage[i % lanes]);
            let innovation: f64 = StandardNormal.sample(&mut self.rng);
            let correlation = if is_first_interval || shrinkage.correlation_intervals <= 0.0 {
                0.0
            } else {
                (-1.0 / shrinkage.correlation_intervals).exp()
            };
            *noise_state = correlation * *noise_state + (1.0 - correlation * correlation).sqrt() * innovation;
            *rate = shrinkage.gain * self.units.mean[k] * f64::from(mean[i])
                + shrinkage.spread * self.units.deviation[k] * f64::from(sd[i]) * *noise_state;
        }
    }
}
