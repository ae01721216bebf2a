//! Hybrid+ as a transition model: the physics engine plus the net's correction of each step.

use super::{Moments, TransitionModel};
use crate::difference::Difference;
use crate::engine::Engine;
use crate::latent::LatentDistribution;
use crate::nets::{Net, StepRunner, Stepwise};
use crate::scales::Scales;
use crate::settings::Correction;
use crate::steps::StepRowInputs;
use crate::{NetModel, TrainerError};
use augsim_nn::Params;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Accuracy of a corrected step along a smooth path, in standard deviations of a state column.
/// Single-precision rounding of the features and the decoder's residual error of a step add up to about this
/// over tens of rows.
const RESOLUTION: f64 = 1e-3;

/// The physics engine's steps, corrected by a trained net, as a transition model.
#[derive(Debug)]
pub struct NetTransition<'m> {
    net: &'m Stepwise,
    params: &'m Params<f32>,
    engine: &'m Engine,
    scales: &'m Scales,
    prior: &'m LatentDistribution,
    /// Decoders of the net, one per number of lanes: particles, cubature points and forecast samples differ.
    runners: Vec<StepRunner>,
    whitened: Vec<f64>,
    engine_next: Vec<f64>,
    reading: StepRowInputs,
    features: Vec<f32>,
}

impl<'m> NetTransition<'m> {
    /// Creates the transition model of a trained net that corrects single steps.
    ///
    /// # Errors
    /// [`TrainerError::Mismatch`] if the net is of another kind, or its training has not ended.
    pub fn new(model: &'m NetModel) -> Result<Self, TrainerError> {
        let state = model.state();
        let (Net::Stepwise(net), Correction::Step) = (model.net(), state.settings.correction) else {
            return Err(Difference::NotFilterable.into());
        };
        let Some(prior) = &state.latent else {
            return Err(Difference::Unfinished.into());
        };
        Ok(NetTransition {
            net,
            params: model.params(),
            engine: &state.settings.engine,
            scales: &state.scales,
            prior,
            runners: Vec::new(),
            whitened: vec![0.0; net.sizes().latent],
            engine_next: vec![0.0; net.sizes().state],
            reading: StepRowInputs::default(),
            features: vec![0.0; net.sizes().condition],
        })
    }
}

impl TransitionModel for NetTransition<'_> {
    fn latent_dim(&self) -> usize {
        self.net.sizes().latent
    }

    fn state_dim(&self) -> usize {
        self.net.sizes().state
    }

    fn draw(&self, count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        let l = self.latent_dim();
        let mut latents = Vec::with_capacity(count * l);
        for _ in 0..count {
            let draws: Vec<f64> = (0..l).map(|_| StandardNormal.sample(rng)).collect();
            latents.extend(self.prior.scale_standard_draws(&draws));
        }
        latents
    }

    fn log_density(&mut self, latent: &[f64]) -> f64 {
        self.prior.log_density(latent, &mut self.whitened)
    }

    fn resolution(&self, j: usize) -> f64 {
        RESOLUTION * self.scales.sd[j]
    }

    fn advance(
        &mut self,
        states: &[f64],
        latents: &[f64],
        [from, to]: [&[f64]; 2],
        next: Moments<'_>,
    ) -> Result<(), TrainerError> {
        let sizes = self.net.sizes();
        let (s, l) = (sizes.state, sizes.latent);
        let lanes = states.len() / s;
        let index = self.runners.iter().position(|r| r.lanes() == lanes).unwrap_or_else(|| {
            self.runners.push(StepRunner::new(self.net, self.params, lanes));
            self.runners.len() - 1
        });
        let runner = &mut self.runners[index];
        let (features, w) = runner.input();
        for lane in 0..lanes {
            let now = &states[lane * s..(lane + 1) * s];
            self.engine.step(now, from, to, &mut self.engine_next);
            self.reading.write(
                (self.engine, self.scales),
                [now, &self.engine_next],
                [from, to],
                &mut self.features,
            );
            for (slot, v) in features[lane..].iter_mut().step_by(lanes).zip(&self.features) {
                *slot = *v;
            }
            for (slot, v) in w[lane..].iter_mut().step_by(lanes).zip(&latents[lane * l..(lane + 1) * l]) {
                *slot = *v as f32;
            }
            next.mean[lane * s..(lane + 1) * s].copy_from_slice(&self.engine_next);
        }
        let (mean, sd) = runner.run();
        for lane in 0..lanes {
            let now = &states[lane * s..(lane + 1) * s];
            for j in 0..s {
                // The unit of a correction depends on the engine's step in this column alone, so the column
                // can be overwritten right away.
                let moved = next.mean[lane * s + j];
                let unit = self.scales.unit_of(j, moved - now[j]);
                next.mean[lane * s + j] = moved + unit * f64::from(mean[j * lanes + lane]);
                next.variance[lane * s + j] = (unit * f64::from(sd[j * lanes + lane])).powi(2);
            }
        }
        Ok(())
    }
}
