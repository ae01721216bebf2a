//! A perceptron that predicts the next state, or corrects a physics step.
//!
//! The paper's classes (b) and (c), with two hidden layers. Deterministic, trained on squared errors.

use super::strides::{self, CorrectionSampler};
use super::{Class, Defaults, Extents, Kind, Learned, Trained, operands, zero};
use crate::league::inputs::ClassInputs;
use crate::nets::tile::{LossVars, Tile, masked_sum};
use crate::settings::Settings;
use crate::{Samples, Task, TrainerError};
use augsim_nn::inference::{LinearRunner, MlpRunner};
use augsim_nn::{Bound, Linear, Mlp, Params};
use augsim_tensor::{Scalar, Tape, TensorError};
use rand_xoshiro::Xoshiro256PlusPlus;

const fn class(physics: bool) -> Class {
    Class {
        kind: Kind::FeedForward,
        inputs: ClassInputs::Steps { physics, members: 0 },
        defaults: Defaults { hidden: 32, sd_floor: 0.0, learning_rate: 3e-3 },
        is_pushing_only: false,
    }
}

pub(crate) static FEED_FORWARD: Class = class(false);
pub(crate) static FEED_FORWARD_RESIDUAL: Class = class(true);

/// The perceptron that predicts the next state, or corrects a physics step.
#[derive(Debug, Clone)]
pub struct FeedForward {
    extents: Extents,
    hidden: Mlp,
    out: Linear,
    physics: bool,
}

impl FeedForward {
    pub fn new<T: Scalar>(settings: &Settings, extents: Extents, params: &mut Params<T>) -> Self {
        let h = settings.net.hidden;
        FeedForward {
            extents,
            hidden: Mlp::new(params, "step", &[extents.condition, h, h]),
            out: Linear::new(params, "out", h, extents.state),
            physics: !settings.recipe.is_without_physics(),
        }
    }
}

impl Learned for FeedForward {
    fn is_deterministic(&self) -> bool {
        true
    }

    fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError> {
        let (x, u, mask) = operands(tape, &tile, self.extents)?;
        let h = self.hidden.forward(tape, p, u)?;
        let mean = self.out.forward(tape, p, h)?;
        let error = tape.squared_error(x, mean)?;
        let nll = masked_sum(tape, error, mask)?;
        Ok(LossVars { total: nll, kl: zero(tape)?, negative_ln_likelihood: nll })
    }

    fn forecast(
        &self,
        trained: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        let mut runner = Runner {
            hidden: MlpRunner::new(&self.hidden, trained.params, samples, 1),
            out: LinearRunner::new(self.out, trained.params, samples, 1),
        };
        Ok(strides::roll_out(trained, self.physics, task, samples, &mut runner))
    }
}

struct Runner {
    hidden: MlpRunner,
    out: LinearRunner,
}

impl CorrectionSampler for Runner {
    fn sample(&mut self, u: &[f32], _: &mut Xoshiro256PlusPlus, out: &mut [f32]) {
        out.copy_from_slice(self.out.run(self.hidden.run(u, 1), 1));
    }
}
