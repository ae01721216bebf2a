//! A trained net in a control loop: one trajectory, one step at a time, nothing allocated after the first step.

use crate::engine::Engine;
use crate::models::NetModel;
use crate::nets::{DcvrnnSampler, Net, Stepwise};
use crate::noise::normals;
use crate::recipe::Recipe;
use crate::scales::Scales;
use crate::settings::Correction;
use crate::steps::StepReading;
use crate::{Difference, LatentLaw, TrainerError};
use augsim_nn::{Bound, Params};
use augsim_tensor::Tape;
use augsim_tensor::kernels::normal::NormalLanes;

/// A trained net that goes step by step, for nets that correct single steps of an engine on which nobody acts.
#[derive(Debug)]
pub struct Stepper {
    seed: u64,
    /// State that was given last, and where the physics goes from it.
    state: Vec<f64>,
    physics: Vec<f64>,
    mean: Vec<f64>,
    sd: Vec<f64>,
    engine: Engine,
    scales: Scales,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    /// The paper's nets: conditioned on the first state and the physics from there, with memory.
    Remembering(Box<Remembering>),
    /// Hybrid+: the distribution of the next state of any state, given the latent of the trajectory.
    Stepwise(Box<Stepping>),
}

#[derive(Debug)]
struct Remembering {
    recipe: Recipe,
    sampler: DcvrnnSampler,
    noise: NormalLanes,
    /// The first state and the physics from there, at the sample that comes next.
    condition: Vec<f32>,
    eps: Vec<f32>,
    first: Vec<f64>,
}

#[derive(Debug)]
struct Stepping {
    net: Stepwise,
    params: Params<f32>,
    law: LatentLaw,
    tape: Tape<f32>,
    bound: Bound,
    reading: StepReading,
    features: Vec<f32>,
    latent: Vec<f32>,
}

/// Normal distribution of the next state, `[S]` each, in the units of the state columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Next<'a> {
    /// Mean.
    pub mean: &'a [f64],
    /// Standard deviation; 0 for the paper's nets, whose draws differ by their latent alone.
    pub sd: &'a [f64],
}

impl Stepper {
    /// The net of a trained model, at the start of a trajectory of zeros.
    ///
    /// # Errors
    /// [`TrainerError::Foreign`] for nets that correct whole roll-outs under actions, and for one whose training has not ended.
    pub fn new(model: &NetModel) -> Result<Self, TrainerError> {
        let settings = &model.state().settings;
        if settings.correction != Correction::Step || !settings.engine.action_columns().is_empty() {
            return Err(Difference::OnlyRollouts.into());
        }
        let states = settings.engine.columns().len();
        let kind = match model.net() {
            Net::Class(_) => return Err(Difference::OnlyRollouts.into()),
            Net::Dcvrnn(net) => {
                let sizes = net.sizes();
                Kind::Remembering(Box::new(Remembering {
                    recipe: settings.recipe,
                    sampler: DcvrnnSampler::new(net, model.params(), 1, 1),
                    noise: normals(settings.seed, "forecast", 0, 1),
                    condition: vec![0.0; sizes.condition],
                    eps: vec![0.0; sizes.latent],
                    first: vec![0.0; states],
                }))
            }
            Net::Stepwise(net) => {
                let law = model.state().latent.clone().ok_or(Difference::Unfinished)?;
                Kind::Stepwise(Box::new(Stepping {
                    features: vec![0.0; net.sizes().condition],
                    latent: vec![0.0; net.sizes().latent],
                    net: net.clone(),
                    params: model.params().clone(),
                    law,
                    tape: Tape::new(),
                    bound: Bound::default(),
                    reading: StepReading::default(),
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

    /// Number of state columns S.
    pub fn states(&self) -> usize {
        self.state.len()
    }

    /// Begins trajectory number `index` at `start [S]`: its random stream, and the latent that it keeps, are those of a
    /// forecast of that number with one sample.
    ///
    /// # Errors
    /// [`TrainerError::Foreign`] if the start has not one value for each state column.
    pub fn begin(&mut self, start: &[f64], index: u64) -> Result<(), TrainerError> {
        self.take(start)?;
        match &mut self.kind {
            Kind::Remembering(r) => {
                r.sampler.reset();
                r.noise = normals(self.seed, "forecast", index << 32, 1);
                r.first.copy_from_slice(start);
                self.physics.copy_from_slice(start);
                // The first sample is the start: what the net says of it moves its memory alone.
                r.advance(&self.physics, &self.scales, &mut self.mean);
            }
            Kind::Stepwise(s) => {
                let draws = crate::noise::standard(self.seed, "forecast", index, s.latent.len());
                s.latent = s.law.draw(&draws, 1);
            }
        }
        Ok(())
    }

    /// The distribution of the state one step after `state [S]`, or after that which was given last. The paper's nets go on
    /// from the start of the trajectory, whatever the state is. Of a draw, a forecast of Hybrid+ also cuts off what neither ground nor
    /// energy allow.
    ///
    /// # Errors
    /// [`TrainerError`] if the state has not one value for each state column, or the net cannot be run.
    pub fn step(&mut self, state: Option<&[f64]>) -> Result<Next<'_>, TrainerError> {
        if let Some(state) = state {
            self.take(state)?;
        }
        match &mut self.kind {
            Kind::Remembering(r) => {
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

    fn take(&mut self, state: &[f64]) -> Result<(), TrainerError> {
        if state.len() != self.state.len() {
            let (expected, found) = (self.state.len(), state.len());
            return Err(Difference::State { expected, found }.into());
        }
        self.state.copy_from_slice(state);
        Ok(())
    }
}

impl Remembering {
    fn advance(&mut self, physics: &[f64], scales: &Scales, mean: &mut [f64]) {
        for (slot, v) in self.condition.iter_mut().zip(self.first.iter().chain(physics)) {
            *slot = *v as f32;
        }
        let standard = self.recipe == Recipe::HybridStandardised;
        if standard {
            scales.standardise(&mut self.condition);
        }
        self.noise.fill(&mut self.eps);
        let predicted = self.sampler.advance(&self.condition, &self.eps);
        for (j, (to, from)) in mean.iter_mut().zip(predicted.mean).enumerate() {
            *to = if standard {
                f64::from((scales.mean[j] + scales.sd[j] * f64::from(*from)) as f32)
            } else {
                f64::from(*from)
            };
        }
    }
}

impl Stepping {
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
