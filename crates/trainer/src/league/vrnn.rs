//! The variational recurrent net of Chung et al. (NeurIPS 2015).
//!
//! Optionally conditioned on the physics roll-out. The paper's decoupled net is derived from it.
//!
//! The initial state x_0 is given: h_0 = GRU(phi_x(x_0)). At every later step t:
//! 1. prior p(z_t) = N(mu_p, sd_p)(h_{t-1}, phi_u(u_t))
//! 2. encoder q(z_t | x_t) = N(mu_q, sd_q)(phi_x(x_t), h_{t-1}, phi_u(u_t)), in training only
//! 3. decoder p(x_t) = N(mu, sd)(phi_z(z_t), h_{t-1})
//! 4. h_t = GRU(phi_x(x_t), phi_z(z_t), phi_u(u_t); h_{t-1})
//! 5. loss = sum over t of KL(q || p) - ln p(x_t), with, for each latent, KL(N(m, s) || N(n, r)) = ln(r / s)
//!    + (s^2 + (m - n)^2) / (2 r^2) - 1/2
//!
//! Encoder and prior read the same h. So, unlike in the decoupled net, the divergence bounds the information
//! in z. Without condition phi_u is omitted.

use super::trajectories::StandardTask;
use super::{Class, Defaults, Extents, Kind, Learned, Trained, operands, zero};
use crate::league::inputs::ClassInputs;
use crate::nets::tile::{LossVars, Tile, masked_sum, repeat_lanes};
use crate::settings::Settings;
use crate::{Samples, Task, TrainerError};
use augsim_data::random_stream;
use augsim_nn::inference::{GaussianRunner, GruRunner, MlpRunner};
use augsim_nn::{Bound, Gaussian, GaussianHead, Gru, Mlp, Params};
use augsim_tensor::{Scalar, Tape, TensorError, Var};
use rand_distr::{Distribution, StandardNormal};

/// Size of the latent z.
const LATENT: usize = 4;
/// Number of features that are extracted from each of x, u and z.
const FEATURES: usize = 16;

const fn class(conditional: bool) -> Class {
    Class {
        kind: Kind::Vrnn { conditional },
        inputs: ClassInputs::Trajectories { physics: conditional },
        defaults: Defaults { hidden: 32, sd_floor: 1e-3, learning_rate: 3e-3 },
        is_pushing_only: false,
    }
}

pub(crate) static VRNN: Class = class(false);
pub(crate) static CONDITIONAL_VRNN: Class = class(true);

/// The variational recurrent net (VRNN).
#[derive(Debug, Clone)]
pub struct Vrnn {
    extents: Extents,
    phi_x: Mlp,
    phi_u: Option<Mlp>,
    phi_z: Mlp,
    prior: (Mlp, GaussianHead),
    encoder: (Mlp, GaussianHead),
    decoder: (Mlp, GaussianHead),
    gru: Gru,
    hidden: usize,
}

impl Vrnn {
    pub fn new<T: Scalar>(
        settings: &Settings,
        extents: Extents,
        conditional: bool,
        params: &mut Params<T>,
    ) -> Self {
        let (h, floor) = (settings.net.hidden, settings.net.sd_floor);
        let u = if conditional { FEATURES } else { 0 };
        let mut part = |name: &str, inputs: usize, outputs: usize, floor: f64| {
            let hidden = Mlp::new(params, name, &[inputs, h]);
            (hidden, GaussianHead::new(params, name, h, outputs, floor))
        };
        let prior = part("prior", h + u, LATENT, 1e-3);
        let encoder = part("enc", FEATURES + h + u, LATENT, 1e-3);
        let decoder = part("dec", FEATURES + h, extents.state, floor);
        Vrnn {
            extents,
            phi_x: Mlp::new(params, "phi_x", &[extents.state, FEATURES]),
            phi_u: conditional.then(|| Mlp::new(params, "phi_u", &[extents.condition, FEATURES])),
            phi_z: Mlp::new(params, "phi_z", &[LATENT, FEATURES]),
            prior,
            encoder,
            decoder,
            gru: Gru::new(params, "gru", 2 * FEATURES + u, h, 1),
            hidden: h,
        }
    }

    fn uses_physics(&self) -> bool {
        self.phi_u.is_some()
    }
}

/// Records the Gaussian that a hidden layer and a head predict from the concatenated `inputs`.
fn gaussian<T: Scalar>(
    tape: &mut Tape<T>,
    p: &Bound,
    (hidden, head): &(Mlp, GaussianHead),
    inputs: &[Var],
) -> Result<Gaussian, TensorError> {
    let input = if let [single] = inputs { *single } else { tape.concat(inputs, 1)? };
    let h = hidden.forward(tape, p, input)?;
    head.forward(tape, p, h)
}

impl Learned for Vrnn {
    fn noise_rows(&self, time: usize) -> (usize, usize) {
        (time, LATENT)
    }

    fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError> {
        let (x, u, mask) = operands(tape, &tile, self.extents)?;
        let (time, lanes) = (tile.time, tile.lanes);
        if time < 2 {
            // The initial state is given, so there is nothing to learn.
            let zero = zero(tape)?;
            return Ok(LossVars { total: zero, kl: zero, negative_ln_likelihood: zero });
        }
        let eps = tape.constant(&[time, LATENT, lanes], tile.eps)?;
        let x_features = self.phi_x.forward(tape, p, x)?;
        let u_features = match &self.phi_u {
            Some(phi) => Some(phi.forward(tape, p, u)?),
            None => None,
        };
        let row = |tape: &mut Tape<T>, v: Var, t: usize| tape.slice(v, 0, t, t + 1);
        let zero_z = tape.constant(&[1, FEATURES, lanes], &vec![T::ZERO; FEATURES * lanes])?;
        let zero_h = tape.constant(&[self.hidden, lanes], &vec![T::ZERO; self.hidden * lanes])?;
        let mut h = tape.reshape(zero_h, &[1, self.hidden, lanes])?;
        // Per step from 1 on: mean and sd of encoder and prior, phi_z(z_t), and h_{t-1}.
        let (mut columns, mut hidden): ([Vec<Var>; 5], Vec<Var>) = Default::default();
        for t in 0..time {
            let fx = row(tape, x_features, t)?;
            let fu = match u_features {
                Some(u) => Some(row(tape, u, t)?),
                None => None,
            };
            let mut fz = zero_z;
            if t > 0 {
                let prior = gaussian(tape, p, &self.prior, &[&[h][..], fu.as_slice()].concat())?;
                let q = gaussian(tape, p, &self.encoder, &[&[fx, h][..], fu.as_slice()].concat())?;
                let e = row(tape, eps, t)?;
                let noise = tape.mul(e, q.sd)?;
                let z = tape.add(q.mean, noise)?;
                fz = self.phi_z.forward(tape, p, z)?;
                for (column, v) in columns.iter_mut().zip([q.mean, q.sd, prior.mean, prior.sd, fz]) {
                    column.push(v);
                }
                hidden.push(h);
            }
            if t + 1 < time {
                let input = tape.concat(&[&[fx, fz][..], fu.as_slice()].concat(), 1)?;
                let before = tape.reshape(h, &[self.hidden, lanes])?;
                h = self.gru.forward(tape, p, input, &[before])?;
            }
        }
        let [q_mean, q_sd, p_mean, p_sd, fz] = columns;
        let mut stack = |rows: &[Var]| tape.concat(rows, 0);
        let (q_mean, q_sd) = (stack(&q_mean)?, stack(&q_sd)?);
        let (p_mean, p_sd) = (stack(&p_mean)?, stack(&p_sd)?);
        let (fz, hidden) = (stack(&fz)?, stack(&hidden)?);
        let mask = match mask {
            Some(mask) => Some(tape.slice(mask, 0, 1, time)?),
            None => None,
        };
        let kl = tape.gaussian_kl((q_mean, q_sd), (p_mean, p_sd))?;
        let kl = masked_sum(tape, kl, mask)?;
        let decoded = gaussian(tape, p, &self.decoder, &[fz, hidden])?;
        let target = tape.slice(x, 0, 1, time)?;
        let nll = tape.gaussian_nll(target, decoded.mean, decoded.sd)?;
        let total_nll = masked_sum(tape, nll, mask)?;
        Ok(LossVars { total: tape.add(kl, total_nll)?, kl, negative_ln_likelihood: total_nll })
    }

    fn forecast(
        &self,
        trained: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        let standard_task = StandardTask::new(trained, self.uses_physics(), task);
        let params = trained.params;
        let mlp = |mlp: &Mlp| MlpRunner::new(mlp, params, samples, 1);
        let pair = |(h, head): &(Mlp, GaussianHead)| (mlp(h), GaussianRunner::new(*head, params, samples, 1));
        let (mut phi_x, mut phi_z) = (mlp(&self.phi_x), mlp(&self.phi_z));
        let mut phi_u = self.phi_u.as_ref().map(mlp);
        let (mut prior, mut decoder) = (pair(&self.prior), pair(&self.decoder));
        let mut gru = GruRunner::new(&self.gru, params, samples, 1);
        let mut rng = random_stream(trained.settings.seed, "league", task.index);
        let mut draw = |(mean, sd): (&[f32], &[f32])| -> Vec<f32> {
            let sample = |(mean, sd): (&f32, &f32)| {
                let noise: f32 = StandardNormal.sample(&mut rng);
                mean + sd * noise
            };
            mean.iter().zip(sd).map(sample).collect()
        };
        let width = standard_task.u.len() / task.time;
        let mut values = Vec::with_capacity(task.time * standard_task.initial_state.len() * samples);
        let mut h = vec![0.0; self.hidden * samples];
        for t in 0..task.time {
            let fu = match &mut phi_u {
                Some(phi) => {
                    phi.run(&repeat_lanes(&standard_task.u[t * width..(t + 1) * width], samples), 1).to_vec()
                }
                None => Vec::new(),
            };
            let mut fz = vec![0.0; FEATURES * samples];
            let x = if t == 0 {
                repeat_lanes(&standard_task.initial_state, samples)
            } else {
                let input = [&h[..], &fu].concat();
                let z = draw(prior.1.run(prior.0.run(&input, 1), 1));
                fz = phi_z.run(&z, 1).to_vec();
                draw(decoder.1.run(decoder.0.run(&[&fz[..], &h].concat(), 1), 1))
            };
            h = gru.run(&[phi_x.run(&x, 1), &fz, &fu].concat(), 1).to_vec();
            values.extend(x);
        }
        Ok(standard_task.restore(trained, task, values, samples))
    }
}
