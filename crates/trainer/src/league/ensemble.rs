//! An ensemble of five probabilistic perceptrons (PETS).
//!
//! Chua, Calandra, McAllister, Levine 2018. Each is trained on a bootstrap sample of the trajectories, and
//! predicts the next state or the residual of a physics step.
//!
//! A sampled trajectory uses one member for the whole roll-out (TS-infinity in the paper of PETS).

use super::strides::{self, CorrectionSampler};
use super::{Class, Defaults, Extents, Kind, Learned, Trained, operands, zero};
use crate::league::inputs::ClassInputs;
use crate::nets::tile::{LossVars, Tile, masked_sum};
use crate::settings::Settings;
use crate::{Samples, Task, TrainerError};
use augsim_nn::inference::{GaussianRunner, MlpRunner};
use augsim_nn::{Bound, GaussianHead, Mlp, Params};
use augsim_tensor::{Scalar, Tape, TensorError};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Number of perceptrons in the ensemble.
const MEMBERS: usize = 5;

const fn class(physics: bool) -> Class {
    Class {
        kind: Kind::Ensemble,
        inputs: ClassInputs::Steps { physics, members: MEMBERS },
        defaults: Defaults { hidden: 32, sd_floor: 1e-2, learning_rate: 3e-3 },
        is_pushing_only: false,
    }
}

pub(crate) static ENSEMBLE: Class = class(false);
pub(crate) static ENSEMBLE_RESIDUAL: Class = class(true);

/// The ensemble of probabilistic perceptrons.
#[derive(Debug, Clone)]
pub struct Ensemble {
    extents: Extents,
    members: Vec<(Mlp, GaussianHead)>,
    physics: bool,
}

impl Ensemble {
    pub fn new<T: Scalar>(settings: &Settings, extents: Extents, params: &mut Params<T>) -> Self {
        let (h, floor) = (settings.net.hidden, settings.net.sd_floor);
        let features = extents.condition - MEMBERS;
        let member = |k: usize| {
            let step = Mlp::new(params, &format!("member{k}.step"), &[features, h, h]);
            (step, GaussianHead::new(params, &format!("member{k}"), h, extents.state, floor))
        };
        Ensemble {
            extents,
            members: (0..MEMBERS).map(member).collect(),
            physics: !settings.recipe.is_without_physics(),
        }
    }
}

impl Learned for Ensemble {
    fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError> {
        let (x, u, mask) = operands(tape, &tile, self.extents)?;
        // The last columns of a condition row are the bootstrap weights.
        let width = self.extents.condition - MEMBERS;
        let features = tape.slice(u, 1, 0, width)?;
        let (mut totals, mut nlls) = (Vec::new(), Vec::new());
        for (k, (step, head)) in self.members.iter().enumerate() {
            let h = step.forward(tape, p, features)?;
            let predicted = head.forward(tape, p, h)?;
            let nll = tape.gaussian_nll(x, predicted.mean, predicted.sd)?;
            let weight = tape.slice(u, 1, width + k, width + k + 1)?;
            let nll = tape.mul(nll, weight)?;
            // Weight of beta-NLL, as in `gaussian_loss`.
            let sd = tape.detach(predicted.sd)?;
            let variance = tape.mul(sd, sd)?;
            let weighted = tape.mul(nll, variance)?;
            totals.push(masked_sum(tape, weighted, mask)?);
            nlls.push(masked_sum(tape, nll, mask)?);
        }
        let mut sum = |parts: Vec<_>| {
            let mut parts = parts.into_iter();
            let first = match parts.next() {
                Some(first) => first,
                None => zero(tape)?,
            };
            parts.try_fold(first, |sum, part| tape.add(sum, part))
        };
        let (total, total_nll) = (sum(totals)?, sum(nlls)?);
        Ok(LossVars { total, kl: zero(tape)?, negative_ln_likelihood: total_nll })
    }

    fn forecast(
        &self,
        trained: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        // Sample i uses member i mod 5; each member runs its samples as one batch.
        let lanes = samples.div_ceil(MEMBERS);
        let runner = |(step, head): &(Mlp, GaussianHead)| {
            (
                MlpRunner::new(step, trained.params, lanes, 1),
                GaussianRunner::new(*head, trained.params, lanes, 1),
            )
        };
        let mut runner = Runner {
            members: self.members.iter().map(runner).collect(),
            features: vec![0.0; (self.extents.condition - MEMBERS) * lanes],
            lanes,
        };
        Ok(strides::roll_out(trained, self.physics, task, samples, &mut runner))
    }
}

struct Runner {
    members: Vec<(MlpRunner, GaussianRunner)>,
    /// Features of the samples that one ensemble member predicts, `[U, lane]`.
    features: Vec<f32>,
    lanes: usize,
}

impl CorrectionSampler for Runner {
    fn sample(&mut self, u: &[f32], rng: &mut Xoshiro256PlusPlus, out: &mut [f32]) {
        let lanes = self.lanes;
        let samples = u.len() / (self.features.len() / lanes);
        for (k, (step, head)) in self.members.iter_mut().enumerate() {
            for (row, member_row) in u.chunks_exact(samples).zip(self.features.chunks_exact_mut(lanes)) {
                member_row
                    .iter_mut()
                    .zip(row[k.min(row.len())..].iter().step_by(MEMBERS))
                    .for_each(|(slot, v)| *slot = *v);
            }
            let (mean, sd) = head.run(step.run(&self.features, 1), 1);
            for (j, row) in out.chunks_exact_mut(samples).enumerate() {
                for (lane, sample) in (k..samples).step_by(MEMBERS).enumerate() {
                    let noise: f32 = StandardNormal.sample(rng);
                    row[sample] = mean[j * lanes + lane] + sd[j * lanes + lane] * noise;
                }
            }
        }
    }
}
