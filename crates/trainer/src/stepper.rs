//! A trained net for control loops: predicts one step at a time, without allocation.

use crate::engine::Engine;
use crate::models::NetModel;
use crate::nets::{DcvrnnSampler, Net, Stepwise};
use crate::noise::{normals, standard};
use crate::recipe::Recipe;
use crate::scales::Scales;
use crate::settings::Correction;
use crate::steps::StepRowInputs;
use crate::{Difference, LatentDistribution, TrainerError};
use augsim_nn::{Bound, Params};
use augsim_tensor::Tape;
use augsim_tensor::kernels::normal::NormalLanes;

/// Predicts a trajectory step by step; for nets that correct single steps without actions.
#[derive(Debug)]
pub struct Stepper {
    seed: u64,
    /// Current state of the trajectory, `[S]`, one value per state column.
    state: Vec<f64>,
    /// Next state that the physics alone predicts, `[S]`, one value per state column.
    physics: Vec<f64>,
    mean: Vec<f64>,
    sd: Vec<f64>,
    engine: Engine,
    scales: Scales,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    /// One of the paper's recurrent nets, conditioned on the initial state and the physics roll-out from it.
    Recurrent(Box<RecurrentStepper>),
    /// Hybrid+: predicts the next state from the current state and the trajectory's latent.
    Stepwise(Box<MarkovStepper>),
}

#[derive(Debug)]
struct RecurrentStepper {
    recipe: Recipe,
    sampler: DcvrnnSampler,
    noise: NormalLanes,
    /// Condition (net input) of the next sample: initial state and physics roll-out.
    condition: Vec<f32>,
    eps: Vec<f32>,
    initial_state: Vec<f64>,
}

#[derive(Debug)]
struct MarkovStepper {
    net: Stepwise,
    params: Params<f32>,
    latent_law: LatentDistribution,
    tape: Tape<f32>,
    bound: Bound,
    reading: StepRowInputs,
    features: Vec<f32>,
    latent: Vec<f32>,
}

/// Normal distribution of the next state, `[S]` each, in the units of the state columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Next<'a> {
    /// Mean of the next state, one value per state column.
    pub mean: &'a [f64],
    /// Standard deviation of the next state; 0 for the paper's nets, whose samples differ only by their latents.
    pub sd: &'a [f64],
}

impl Stepper {
    /// Creates a stepper for a trained model, at trajectory 0 with the initial state 0.
    ///
    /// # Errors
    /// [`TrainerError::Mismatch`] for nets that do not correct single steps, need actions, or are not fully
    /// trained.
    pub fn new(model: &NetModel) -> Result<Self, TrainerError> {
        let settings = &model.state().settings;
        if settings.correction != Correction::Step || !settings.engine.action_columns().is_empty() {
            return Err(Difference::NotSteppable.into());
        }
        let states = settings.engine.columns().len();
        let kind = match model.net() {
            Net::Class(_) => return Err(Difference::NotSteppable.into()),
            Net::Dcvrnn(net) => {
                let sizes = net.sizes();
                Kind::Recurrent(Box::new(RecurrentStepper {
                    recipe: settings.recipe,
                    sampler: DcvrnnSampler::new(net, model.params(), 1, 1),
                    noise: normals(settings.seed, "forecast", 0, 1),
                    condition: vec![0.0; sizes.condition],
                    eps: vec![0.0; sizes.latent],
                    initial_state: vec![0.0; states],
                }))
            }
            Net::Stepwise(net) => {
                let latent_distribution = model.state().latent.clone().ok_or(Difference::Unfinished)?;
                Kind::Stepwise(Box::new(MarkovStepper {
                    features: vec![0.0; net.sizes().condition],
                    latent: vec![0.0; net.sizes().latent],
                    net: net.clone(),
                    params: model.params().clone(),
                    latent_law: latent_distribution,
                    tape: Tape::new(),
                    bound: Bound::default(),
                    reading: StepRowInputs::default(),
                }))
            }
        };
        let mut stepper = Stepper {
            seed: settings.seed,
            state: vec![0.0; states],
            physics: vec![0.0; states],
            mean: vec![0.0; states],
            sd: vec![0.0; states],
            engine: settings.engine.clone(),
            scales: model.state().scales.clone(),
            kind,
        };
        stepper.begin(&vec![0.0; states], 0)?;
        Ok(stepper)
    }

    /// Number of state columns S of the net's engine.
    pub fn states(&self) -> usize {
        self.state.len()
    }

    /// Starts trajectory number `index` at the state `start [S]`, one value per state column.
    ///
    /// Its random stream and its latent equal those of a forecast of task `index` with one sample.
    ///
    /// # Errors
    /// [`TrainerError::Mismatch`] if the start does not have one value per state column.
    pub fn begin(&mut self, start: &[f64], index: u64) -> Result<(), TrainerError> {
        self.set_state(start)?;
        match &mut self.kind {
            Kind::Recurrent(r) => {
                r.sampler.reset();
                r.noise = normals(self.seed, "forecast", index << 32, 1);
                r.initial_state.copy_from_slice(start);
                self.physics.copy_from_slice(start);
                // The first sample is the given start, so the prediction for it is dropped; only the
                // recurrent state matters.
                r.advance(&self.physics, &self.scales, &mut self.mean);
            }
            Kind::Stepwise(s) => {
                let draws = standard(self.seed, "forecast", index, s.latent.len());
                s.latent = s.latent_law.draw(&draws, 1);
            }
        }
        Ok(())
    }

    /// Predicts the distribution of the state one step after `state [S]`, or after the current state if `None`.
    ///
    /// The paper's nets ignore `state`: they continue the roll-out from the start of the trajectory. Unlike a
    /// forecast of Hybrid+, the distribution is not restricted by the ground and energy limits of the ball.
    ///
    /// # Errors
    /// [`TrainerError`] if the state does not have one value per state column, or the net cannot be run.
    pub fn step(&mut self, state: Option<&[f64]>) -> Result<Next<'_>, TrainerError> {
        if let Some(state) = state {
            self.set_state(state)?;
        }
        match &mut self.kind {
            Kind::Recurrent(r) => {
                self.state.copy_from_slice(&self.physics);
                self.engine.step(&self.state, &[], &[], &mut self.physics);
                r.advance(&self.physics, &self.scales, &mut self.mean);
            }
            Kind::Stepwise(s) => {
                self.engine.step(&self.state, &[], &[], &mut self.physics);
                let states = [&self.state[..], &self.physics];
                s.correct((&self.engine, &self.scales), states, &mut self.mean, &mut self.sd)?;
            }
        }
        Ok(Next { mean: &self.mean, sd: &self.sd })
    }

    fn set_state(&mut self, state: &[f64]) -> Result<(), TrainerError> {
        if state.len() != self.state.len() {
            let (expected, found) = (self.state.len(), state.len());
            return Err(Difference::State { expected, found }.into());
        }
        self.state.copy_from_slice(state);
        Ok(())
    }
}

impl RecurrentStepper {
    /// Feeds the next physics state to a recurrent net, and writes the predicted state to `mean [S]`.
    fn advance(&mut self, physics: &[f64], scales: &Scales, mean: &mut [f64]) {
        for (slot, v) in self.condition.iter_mut().zip(self.initial_state.iter().chain(physics)) {
            *slot = *v as f32;
        }
        let is_standardised = self.recipe == Recipe::HybridStandardised;
        if is_standardised {
            scales.standardise(&mut self.condition);
        }
        self.noise.fill(&mut self.eps);
        let predicted = self.sampler.advance(&self.condition, &self.eps);
        for (j, (to, from)) in mean.iter_mut().zip(predicted.mean).enumerate() {
            *to = if is_standardised {
                f64::from((scales.mean[j] + scales.sd[j] * f64::from(*from)) as f32)
            } else {
                f64::from(*from)
            };
        }
    }
}

impl MarkovStepper {
    /// Writes mean and standard deviation of the next state: the physics step from `now` to `next`, corrected.
    fn correct(
        &mut self,
        (engine, scales): (&Engine, &Scales),
        [now, next]: [&[f64]; 2],
        mean: &mut [f64],
        sd: &mut [f64],
    ) -> Result<(), TrainerError> {
        self.reading.write((engine, scales), [now, next], [&[], &[]], &mut self.features);
        self.tape.reset();
        self.params.bind_frozen(&mut self.tape, &mut self.bound)?;
        let u = self.tape.constant(&[1, self.features.len(), 1], &self.features)?;
        let w = self.tape.constant(&[1, self.latent.len(), 1], &self.latent)?;
        let g = self.net.correct(&mut self.tape, &self.bound, u, w)?;
        let (corrections, deviations) = (self.tape.value(g.mean), self.tape.value(g.sd));
        for j in 0..mean.len() {
            let unit = scales.unit(j, now, next);
            mean[j] = next[j] + unit * f64::from(corrections[j]);
            sd[j] = unit * f64::from(deviations[j]);
        }
        Ok(())
    }
}
