//! A trained net as a forecaster, and its reconstructions.

use crate::difference::Difference;
use crate::engine::{Engine, ModelPush};
use crate::featuriser::Featuriser;
use crate::latent::encode;
use crate::league::Trained;
use crate::nets::tile::repeat_lanes;
use crate::nets::{Dcvrnn, DcvrnnSampler, Net, Stepwise};
use crate::noise::{normals, standard};
use crate::push::features::{self, Condition};
use crate::rates::CorrectionShrinkage;
use crate::rates::features::read_shrinkage;
use crate::rates::forecast::{Hybrid, forecast};
use crate::recipe::Recipe;
use crate::sequences::Sequence;
use crate::settings::Correction;
use crate::steps::{StepRowInputs, conditions};
use crate::training::{TrainingState, rebuild_net};
use crate::violations::BallLimits;
use crate::{Forecaster, Samples, TILE, Task, TrainerError};
use augsim_data::random_stream;
use augsim_nn::{Bound, Params};
use augsim_tensor::Tape;
use rand_distr::{Distribution, StandardNormal};

/// Number of time steps per call of a sampler; small enough for its buffers to stay in cache.
const BLOCK_STEPS: usize = 32;

/// A trained net with its parameters, scales and settings.
#[derive(Debug)]
pub struct NetModel {
    state: TrainingState,
    net: Net,
    params: Params<f32>,
}

/// Whether a roll-out adds noise to the mean correction of each step.
#[derive(Debug, Clone, Copy)]
enum StepNoise {
    /// Noise drawn from the predicted distribution, for a forecast.
    Drawn,
    /// No noise: the decoder's mean given the latent, as in the paper's reconstructions.
    Mean,
}

impl NetModel {
    /// Rebuilds the net from a saved training state.
    ///
    /// # Errors
    /// [`TrainerError::Mismatch`] if the state is inconsistent.
    pub fn new(state: TrainingState) -> Result<Self, TrainerError> {
        let (net, params) = rebuild_net(&state)?;
        Ok(NetModel { state, net, params })
    }

    /// Saved training state that the model was built from.
    pub fn state(&self) -> &TrainingState {
        &self.state
    }

    /// Samples reconstructions `[time, S, sample]` of a trajectory that the encoder observes.
    ///
    /// A reconstruction is not a prediction.
    ///
    /// # Errors
    /// [`TrainerError::Mismatch`] for nets that can only forecast; [`TrainerError`] if the net cannot be run.
    pub fn reconstruct(&self, q: &Sequence, index: u64, samples: usize) -> Result<Samples, TrainerError> {
        let settings = &self.state.settings;
        if settings.correction != Correction::Step {
            return Err(Difference::NotReconstructable.into());
        }
        let prepared = Featuriser::for_settings(settings)?.prepare(&self.state.scales, q);
        match &self.net {
            Net::Class(_) => Err(Difference::NotReconstructable.into()),
            Net::Dcvrnn(net) => {
                let (mut tape, bound) = self.frozen_tape()?;
                let x =
                    tape.constant(&[q.time, prepared.x_width, samples], &repeat_lanes(&prepared.x, samples))?;
                let u =
                    tape.constant(&[q.time, prepared.u_width, samples], &repeat_lanes(&prepared.u, samples))?;
                let eps = self.noise("reconstruction", index, q.time * net.sizes().latent * samples);
                let eps = tape.constant(&[q.time, net.sizes().latent, samples], &eps)?;
                let passed = net.pass(&mut tape, &bound, [x, u, eps])?;
                Ok(self.restored_samples(samples, tape.value(passed.mean_x).to_vec()))
            }
            Net::Stepwise(net) => {
                let (mean, sd) = encode(net, &self.params, &prepared)?;
                let mut w = self.noise("reconstruction", index, mean.len() * samples);
                for (i, w) in w.iter_mut().enumerate() {
                    let l = i / samples;
                    *w = (mean[l] + sd[l] * f64::from(*w)) as f32;
                }
                let task = Task { start: q.state(0), actions: &q.actions, time: q.time, index };
                self.roll_out(net, task, &w, samples, StepNoise::Mean)
            }
        }
    }

    /// Shrinkage factors of rate corrections, chosen on held-out records; `None` for other nets.
    pub fn shrinkage(&self) -> Option<CorrectionShrinkage> {
        let has_shrinkage =
            matches!(self.net, Net::Stepwise(_)) && self.state.settings.correction == Correction::Rates;
        has_shrinkage.then(|| read_shrinkage(&self.state.scales))
    }

    /// The net: layers, with the identifiers of their parameters.
    pub(crate) fn net(&self) -> &Net {
        &self.net
    }

    /// Values of the net's parameters, under PyTorch's names.
    pub fn params(&self) -> &Params<f32> {
        &self.params
    }

    /// Copies the net with another engine of the same scenario, e.g. another object or support.
    ///
    /// # Errors
    /// [`TrainerError::Mismatch`] if the engine has different columns.
    pub fn with_engine(&self, engine: Engine) -> Result<Self, TrainerError> {
        let mut state = self.state.clone();
        let old = &state.settings.engine;
        if (old.columns(), old.action_columns()) != (engine.columns(), engine.action_columns()) {
            return Err(Difference::OtherSystem.into());
        }
        state.settings.engine = engine;
        Self::new(state)
    }

    /// Copies the net with another seed for the random draws of its forecasts.
    ///
    /// # Errors
    /// As [`NetModel::new`].
    pub fn with_seed(&self, seed: u64) -> Result<Self, TrainerError> {
        let mut state = self.state.clone();
        state.settings.seed = seed;
        Self::new(state)
    }

    /// Wraps sampled values as [`Samples`], converted back from standard units if the recipe standardises states.
    fn restored_samples(&self, count: usize, mut values: Vec<f32>) -> Samples {
        if self.state.settings.recipe == Recipe::HybridStandardised {
            self.state.scales.restore(&mut values, count);
        }
        Samples { count, values }
    }

    /// Creates a tape with the net's parameters as constants, which are not differentiated.
    fn frozen_tape(&self) -> Result<(Tape<f32>, Bound), TrainerError> {
        let (mut tape, mut bound) = (Tape::new(), Bound::default());
        self.params.bind_frozen(&mut tape, &mut bound)?;
        Ok((tape, bound))
    }

    /// Draws `n` standard normal numbers from the random stream of this purpose and index, with the run's seed.
    fn noise(&self, purpose: &str, index: u64, n: usize) -> Vec<f32> {
        standard(self.state.settings.seed, purpose, index, n)
    }

    /// Simulates the physics and its corrections step by step, for one latent `[L]` per sample in `w [L, samples]`.
    fn roll_out(
        &self,
        net: &Stepwise,
        task: Task<'_>,
        w: &[f32],
        samples: usize,
        noise: StepNoise,
    ) -> Result<Samples, TrainerError> {
        let Task { start, actions, time, index } = task;
        let (s, sizes) = (start.len(), net.sizes());
        let (engine, scales) = (&self.state.settings.engine, &self.state.scales);
        let width = engine.action_columns().len();
        let action = |t: usize| &actions[t * width..(t + 1) * width];
        let limits = BallLimits::for_engine(engine, start);
        let mut tape = Tape::new();
        let mut bound = Bound::default();
        let mut rng = random_stream(self.state.settings.seed, "step-noise", index);
        let mut values = vec![0.0_f32; time * s * samples];
        let mut now: Vec<f64> = start.repeat(samples);
        let mut next = now.clone();
        let mut corrected = vec![0.0; s];
        let (mut row, mut reading) = (vec![0.0_f32; sizes.condition], StepRowInputs::default());
        let mut u = vec![0.0_f32; sizes.condition * samples];
        for t in 0..time {
            for sample in 0..samples {
                for j in 0..s {
                    values[(t * s + j) * samples + sample] = now[sample * s + j] as f32;
                }
            }
            if t + 1 == time {
                break;
            }
            for sample in 0..samples {
                let (from, to) = (&now[sample * s..][..s], &mut next[sample * s..][..s]);
                engine.step(from, action(t), action(t + 1), to);
                reading.write((engine, scales), [from, to], [action(t), action(t + 1)], &mut row);
                for (slot, v) in u[sample..].iter_mut().step_by(samples).zip(&row) {
                    *slot = *v;
                }
            }
            tape.reset();
            self.params.bind_frozen(&mut tape, &mut bound)?;
            let u = tape.constant(&[1, sizes.condition, samples], &u)?;
            let w = tape.constant(&[1, sizes.latent, samples], w)?;
            let g = net.correct(&mut tape, &bound, u, w)?;
            let (mean, sd) = (tape.value(g.mean), tape.value(g.sd));
            for sample in 0..samples {
                for j in 0..s {
                    let index = j * samples + sample;
                    let draw: f64 = match noise {
                        StepNoise::Drawn => StandardNormal.sample(&mut rng),
                        StepNoise::Mean => 0.0,
                    };
                    let correction = f64::from(mean[index]) + f64::from(sd[index]) * draw;
                    let (from, to) = (&now[sample * s..][..s], &next[sample * s..][..s]);
                    corrected[j] = to[j] + scales.unit(j, from, to) * correction;
                }
                if let (Some(limits), [height, velocity]) = (&limits, &mut corrected[..]) {
                    let (from, expected) = (&now[sample * s..][..s], &next[sample * s..][..s]);
                    let [from, expected] = [from, expected].map(|v| [v[0], v[1]]);
                    [*height, *velocity] = limits.allowed(from, expected, [*height, *velocity]);
                }
                now[sample * s..][..s].copy_from_slice(&corrected);
            }
        }
        Ok(Samples { count: samples, values })
    }

    /// Samples forecasts of one of the paper's nets: prior and decoder, in blocks of steps.
    fn generate(&self, net: &Dcvrnn, task: Task<'_>, samples: usize) -> Samples {
        let Task { start, actions, time, index } = task;
        let (settings, sizes) = (&self.state.settings, net.sizes());
        let u = conditions(settings.recipe, &settings.engine, &self.state.scales, start, actions, time);
        let mut values = vec![0.0; time * sizes.state * samples];
        let mut repeated_u = Vec::new();
        let mut eps = Vec::new();
        for first in (0..samples).step_by(TILE) {
            let lanes = TILE.min(samples - first);
            let mut sampler = DcvrnnSampler::new(net, &self.params, lanes, BLOCK_STEPS);
            // One stream per (trajectory, sample); the shift leaves room for 2^32 samples per trajectory.
            let mut noise = normals(settings.seed, "forecast", (index << 32) + first as u64, lanes);
            for start in (0..time).step_by(BLOCK_STEPS) {
                let steps = BLOCK_STEPS.min(time - start);
                repeated_u.clear();
                for v in &u[start * sizes.condition..][..steps * sizes.condition] {
                    repeated_u.extend(std::iter::repeat_n(*v, lanes));
                }
                eps.resize(steps * sizes.latent * lanes, 0.0);
                noise.fill(&mut eps);
                let mean = sampler.advance(&repeated_u, &eps).mean;
                for (i, row) in mean.chunks_exact(lanes).enumerate() {
                    let offset = (start * sizes.state + i) * samples + first;
                    values[offset..offset + lanes].copy_from_slice(row);
                }
            }
        }
        self.restored_samples(samples, values)
    }

    /// Draws latents `[L, samples]` from the distribution fitted on the training set.
    fn draw_latents(&self, net: &Stepwise, index: u64, samples: usize) -> Result<Vec<f32>, TrainerError> {
        let Some(law) = &self.state.latent else {
            return Err(Difference::Unfinished.into());
        };
        Ok(law.draw(&self.noise("forecast", index, net.sizes().latent * samples), samples))
    }

    /// Samples forecasts of a push from its initial pose and the rod's path, decoder noise included.
    fn forecast_push(
        &self,
        engine: &ModelPush,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        let scales = &self.state.scales;
        let condition = Condition::new(self.state.settings.recipe, engine, task.start, task.actions);
        let u = features::standard(scales, &condition);
        let (time, width) = (condition.time, condition.width);
        let (mut tape, bound) = self.frozen_tape()?;
        let (mean, sd) = match &self.net {
            Net::Class(_) => return Err(Difference::NotSteppable.into()),
            Net::Dcvrnn(net) => {
                let latent = net.sizes().latent;
                let u = tape.constant(&[time, width, samples], &repeat_lanes(&u, samples))?;
                let eps = self.noise("forecast", task.index, time * latent * samples);
                let eps = tape.constant(&[time, latent, samples], &eps)?;
                net.generate(&mut tape, &bound, u, eps)?
            }
            Net::Stepwise(net) => {
                let w = self.draw_latents(net, task.index, samples)?;
                let u = tape.constant(&[time, width, 1], &u)?;
                let input = net.read_features(&mut tape, &bound, u)?;
                let shape = [time, tape.shape(input).dims()[1], samples];
                let input = repeat_lanes(tape.value(input), samples);
                let input = tape.constant(&shape, &input)?;
                let w = tape.constant(&[1, net.sizes().latent, samples], &w)?;
                let g = net.correct(&mut tape, &bound, input, w)?;
                (g.mean, Some(g.sd))
            }
        };
        let mut values = tape.value(mean).to_vec();
        if let Some(sd) = sd {
            let noise = self.noise("step-noise", task.index, values.len());
            for ((v, sd), noise) in values.iter_mut().zip(tape.value(sd)).zip(noise) {
                *v += sd * noise;
            }
        }
        features::restore(scales, &condition, &mut values, samples);
        // The initial pose is given, so it has no uncertainty.
        for (row, start) in values.chunks_exact_mut(samples).zip(task.start) {
            row.fill(*start as f32);
        }
        Ok(Samples { count: samples, values })
    }
}

impl Forecaster for NetModel {
    fn name(&self) -> &str {
        self.state.settings.recipe.label()
    }

    fn is_deterministic(&self) -> bool {
        matches!(&self.net, Net::Class(net) if net.is_deterministic())
    }

    fn forecast(&self, task: Task<'_>, samples: usize) -> Result<Samples, TrainerError> {
        let settings = &self.state.settings;
        let (states, actions) = (settings.engine.columns(), settings.engine.action_columns());
        let starts = match settings.correction {
            // For systems of equations each sample may have its own initial state.
            Correction::Rates if task.start.len() == states.len() * samples => 1,
            _ => task.start.len() / states.len().max(1),
        };
        if starts != 1 || task.start.is_empty() || task.actions.len() != actions.len() * task.time {
            let columns = [states, actions].concat().into_iter().map(Into::into).collect();
            return Err(Difference::Inputs { columns }.into());
        }
        if let Net::Class(net) = &self.net {
            let trained = Trained { settings, scales: &self.state.scales, params: &self.params };
            return net.forecast(trained, task, samples);
        }
        if let Some(push) = settings.rollouts()? {
            return self.forecast_push(push, task, samples);
        }
        match &self.net {
            Net::Class(_) => Err(Difference::NotSteppable.into()),
            Net::Dcvrnn(net) => Ok(self.generate(net, task, samples)),
            Net::Stepwise(net) if settings.correction == Correction::Rates => {
                let law = self.state.latent.as_ref().ok_or(Difference::Unfinished)?;
                let (scales, params) = (&self.state.scales, &self.params);
                forecast(Hybrid { settings, scales, params, net, law }, task, samples)
            }
            Net::Stepwise(net) => {
                let w = self.draw_latents(net, task.index, samples)?;
                self.roll_out(net, task, &w, samples, StepNoise::Drawn)
            }
        }
    }
}
