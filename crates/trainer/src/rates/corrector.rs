//! The corrections of Hybrid+ along roll-outs side by side.

use super::features::{Trust, Units};
use crate::nets::{StepRunner, Stepwise};
use augsim_nn::Params;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A net with the latent of each lane.
pub(crate) struct Corrector<'a> {
    runner: StepRunner,
    latents: Vec<f32>,
    /// Trust in each lane, beyond that of the units.
    trust: Vec<Trust>,
    units: Units<'a>,
    /// Standard normal numbers that wander, `[D, lane]`; empty before the first interval.
    wandering: Vec<f64>,
    rng: Xoshiro256PlusPlus,
}

impl<'a> Corrector<'a> {
    /// The corrections of `net` in as many lanes as there are `trust`s, with `latents [L, lane]`.
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

    /// Draws the changes of rates `[D, lane]`, per second, for features `u [U, lane]`.
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
