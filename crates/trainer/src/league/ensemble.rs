//! Five probabilistic perceptrons, each trained on a bootstrap of the trajectories (PETS: Chua, Calandra, McAllister, Levine 2018), as a
//! model of the motion or of what a physics step leaves. A sample stays with one member over the whole roll-out (their TS-infinity).

use super::strides::{self, Steps};
use super::{Class, Extents, Kind, Learned, Plan, Trained, operands, zero};
use crate::league::reads::Reads;
use crate::nets::tile::{LossVars, Tile, masked_sum};
use crate::settings::Settings;
use crate::{Samples, Task, TrainerError};
use augsim_nn::inference::{GaussianRunner, MlpRunner};
use augsim_nn::{Bound, GaussianHead, Mlp, Params};
use augsim_tensor::{Scalar, Tape, TensorError};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Members of the ensemble.
const MEMBERS: usize = 5;

const fn class(physics: bool) -> Class {
    Class {
        kind: Kind::Ensemble,
        reads: Reads::Strides { physics, members: MEMBERS },
        plan: Plan { hidden: 32, sd_floor: 1e-2, learning_rate: 3e-3 },
        pushing_only: false,
    }
}

pub(crate) static ENSEMBLE: Class = class(false);
pub(crate) static ENSEMBLE_RESIDUAL: Class = class(true);

/// The members.
#[derive(Debug, Clone)]
pub struct Ensemble {
    extents: Extents,
    members: Vec<(Mlp, GaussianHead)>,
    physics: bool,
}

impl Ensemble {
    pub fn new<T: Scalar>(settings: &Settings, extents: Extents, params: &mut Params<T>) -> Self {
        let (h, floor) = (settings.net.hidden, settings.net.sd_floor);
        let seen = extents.condition - MEMBERS;
        let member = |k: usize| {
            let step = Mlp::new(params, &format!("member{k}.step"), &[seen, h, h]);
            (step, GaussianHead::new(params, &format!("member{k}"), h, extents.state, floor))
        };
        Ensemble {
            extents,
            members: (0..MEMBERS).map(member).collect(),
            physics: !settings.recipe.is_blind(),
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
        let seen = self.extents.condition - MEMBERS;
        let features = tape.slice(u, 1, 0, seen)?;
        let (mut totals, mut misfits) = (Vec::new(), Vec::new());
        for (k, (step, head)) in self.members.iter().enumerate() {
            let h = step.forward(tape, p, features)?;
            let law = head.forward(tape, p, h)?;
            let nll = tape.gaussian_nll(x, law.mean, law.sd)?;
            let weight = tape.slice(u, 1, seen + k, seen + k + 1)?;
            let nll = tape.mul(nll, weight)?;
            // The weight of beta-NLL, for the reason that `gaussian_loss` gives.
            let sd = tape.detach(law.sd)?;
            let variance = tape.mul(sd, sd)?;
            let tempered = tape.mul(nll, variance)?;
            totals.push(masked_sum(tape, tempered, mask)?);
            misfits.push(masked_sum(tape, nll, mask)?);
        }
        let mut sum = |parts: Vec<_>| {
            let mut parts = parts.into_iter();
            let first = match parts.next() {
                Some(first) => first,
                None => zero(tape)?,
            };
            parts.try_fold(first, |sum, part| tape.add(sum, part))
        };
        let (total, misfit) = (sum(totals)?, sum(misfits)?);
        Ok(LossVars { total, kl: zero(tape)?, misfit })
    }

    fn forecast(
        &self,
        trained: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        // Sample i belongs to member i mod 5, whose lanes lie side by side.
        let lanes = samples.div_ceil(MEMBERS);
        let runner = |(step, head): &(Mlp, GaussianHead)| {
            (
                MlpRunner::new(step, trained.params, lanes, 1),
                GaussianRunner::new(*head, trained.params, lanes, 1),
            )
        };
        let mut runner = Runner {
            members: self.members.iter().map(runner).collect(),
            seen: vec![0.0; (self.extents.condition - MEMBERS) * lanes],
            lanes,
        };
        Ok(strides::roll(trained, self.physics, task, samples, &mut runner))
    }
}

struct Runner {
    members: Vec<(MlpRunner, GaussianRunner)>,
    seen: Vec<f32>,
    lanes: usize,
}

impl Steps for Runner {
    fn draw(&mut self, u: &[f32], rng: &mut Xoshiro256PlusPlus, out: &mut [f32]) {
        let lanes = self.lanes;
        let samples = u.len() / (self.seen.len() / lanes);
        for (k, (step, head)) in self.members.iter_mut().enumerate() {
            for (row, own) in u.chunks_exact(samples).zip(self.seen.chunks_exact_mut(lanes)) {
                own.iter_mut()
                    .zip(row[k.min(row.len())..].iter().step_by(MEMBERS))
                    .for_each(|(o, v)| *o = *v);
            }
            let (mean, sd) = head.run(step.run(&self.seen, 1), 1);
            for (j, row) in out.chunks_exact_mut(samples).enumerate() {
                for (lane, sample) in (k..samples).step_by(MEMBERS).enumerate() {
                    let noise: f32 = StandardNormal.sample(rng);
                    row[sample] = mean[j * lanes + lane] + sd[j * lanes + lane] * noise;
                }
            }
        }
    }
}
