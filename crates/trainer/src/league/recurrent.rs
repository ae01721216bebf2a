//! A recurrent net without latent that corrects a physics step: the paper's class (d).
//!
//! Standard deviations are learned. The second variant predicts a mixture of Gaussians per step (Bishop
//! 1994).

use super::strides::{self, CorrectionSampler};
use super::{Class, Defaults, Extents, Kind, Learned, Trained, gaussian_loss, operands, zero};
use crate::league::inputs::ClassInputs;
use crate::nets::tile::{LossVars, Tile, masked_sum};
use crate::settings::Settings;
use crate::{Samples, Task, TrainerError};
use augsim_nn::inference::{GaussianRunner, GruRunner};
use augsim_nn::{Bound, GaussianHead, Gru, MixtureHead, MixtureRunner, Params};
use augsim_tensor::{Scalar, Tape, TensorError};
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_xoshiro::Xoshiro256PlusPlus;

const fn class(components: usize) -> Class {
    Class {
        kind: Kind::Recurrent { components },
        inputs: ClassInputs::Steps { physics: true, members: 0 },
        defaults: Defaults { hidden: 32, sd_floor: 1e-2, learning_rate: 3e-3 },
        is_pushing_only: false,
    }
}

pub(crate) static RECURRENT_RESIDUAL: Class = class(1);
pub(crate) static MIXTURE_RESIDUAL: Class = class(5);

/// Output distribution of the correction of a step: Gaussian or mixture.
#[derive(Debug, Clone)]
enum Head {
    Gaussian(GaussianHead),
    Mixture(MixtureHead),
}

/// A GRU over the features of the steps, and a head that predicts the correction of each step.
#[derive(Debug, Clone)]
pub struct Recurrent {
    extents: Extents,
    memory: Gru,
    head: Head,
}

impl Recurrent {
    pub fn new<T: Scalar>(
        settings: &Settings,
        extents: Extents,
        components: usize,
        params: &mut Params<T>,
    ) -> Self {
        let (h, s, floor) = (settings.net.hidden, extents.state, settings.net.sd_floor);
        let memory = Gru::new(params, "memory", extents.condition, h, 1);
        let head = match components {
            1 => Head::Gaussian(GaussianHead::new(params, "step", h, s, floor)),
            _ => Head::Mixture(MixtureHead::new(params, "step", [h, s, components], floor)),
        };
        Recurrent { extents, memory, head }
    }
}

impl Learned for Recurrent {
    fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError> {
        let (x, u, mask) = operands(tape, &tile, self.extents)?;
        let h = self.memory.forward(tape, p, u, &[])?;
        match &self.head {
            Head::Gaussian(head) => {
                let predicted = head.forward(tape, p, h)?;
                gaussian_loss(tape, x, predicted, mask)
            }
            Head::Mixture(head) => {
                let nll = head.nll(tape, p, h, x)?;
                let total_nll = masked_sum(tape, nll, mask)?;
                Ok(LossVars { total: total_nll, kl: zero(tape)?, negative_ln_likelihood: total_nll })
            }
        }
    }

    fn forecast(
        &self,
        trained: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        let params = trained.params;
        let mut runner = Runner {
            memory: GruRunner::new(&self.memory, params, samples, 1),
            uniform: vec![0.0; samples],
            head: match &self.head {
                Head::Gaussian(head) => HeadRunner::Gaussian(GaussianRunner::new(*head, params, samples, 1)),
                Head::Mixture(head) => HeadRunner::Mixture(MixtureRunner::new(head, params, samples)),
            },
        };
        Ok(strides::roll_out(trained, true, task, samples, &mut runner))
    }
}

enum HeadRunner {
    Gaussian(GaussianRunner),
    Mixture(MixtureRunner),
}

struct Runner {
    memory: GruRunner,
    head: HeadRunner,
    uniform: Vec<f32>,
}

impl CorrectionSampler for Runner {
    fn sample(&mut self, u: &[f32], rng: &mut Xoshiro256PlusPlus, out: &mut [f32]) {
        let h = self.memory.run(u, 1);
        let (mean, sd) = match &mut self.head {
            HeadRunner::Gaussian(head) => head.run(h, 1),
            HeadRunner::Mixture(head) => {
                self.uniform.iter_mut().for_each(|v| *v = StandardUniform.sample(rng));
                head.choose(h, &self.uniform)
            }
        };
        for ((out, mean), sd) in out.iter_mut().zip(mean).zip(sd) {
            let noise: f32 = StandardNormal.sample(rng);
            *out = mean + sd * noise;
        }
    }
}
