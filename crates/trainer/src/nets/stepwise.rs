//! Hybrid+: physics step by step, one latent per trajectory, learned deviations.
//!
//! Where the paper's net rolls the physics out from s_0 alone and corrects the whole curve, this one asks
//! the physics for one step from the state that was predicted last and corrects that step:
//! s_{t+1} ~ N(f_p(s_t) + scale * mu(c_t, w), scale * sigma(c_t, w)), with c_t features of s_t and f_p(s_t).
//! What differs from trajectory to trajectory and cannot be seen at t = 0 (the restitution, say) is the
//! latent w, one draw per trajectory. An encoder infers w from the whole trajectory during training only;
//! a forecast draws w from a Gaussian fitted to what the encoder gave on the training set (ex-post density
//! estimation, Ghosh et al. 2020), because the divergence of one latent hardly weighs against the
//! likelihood of hundreds of steps.
//!
//! Loss: KL(q(w | trajectory) || N(0, I)) - sum over t of ln P(s_{t+1} | s_t, w), less constants.

use super::{LossVars, Tile, mask_of, masked_sum};
use augsim_nn::{Bound, Gaussian, GaussianHead, Gru, Mlp, Params};
use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// Extents of a [`Stepwise`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepwiseSizes {
    /// State columns: width of a correction.
    pub state: usize,
    /// Width of the features c_t.
    pub condition: usize,
    /// Width of the latent w.
    pub latent: usize,
    /// Units of each hidden layer.
    pub hidden: usize,
    /// Added to learned standard deviations, in units of the correction's scale.
    pub sd_floor: f64,
}

/// The net: encoder GRU and head, and a perceptron for the correction of a step.
#[derive(Debug, Clone)]
pub struct Stepwise {
    sizes: StepwiseSizes,
    encoder: Gru,
    encoder_head: GaussianHead,
    step: Mlp,
    step_head: GaussianHead,
}

impl Stepwise {
    /// Registers the parameters.
    pub fn new<T: Scalar>(params: &mut Params<T>, s: StepwiseSizes) -> Self {
        Stepwise {
            sizes: s,
            encoder: Gru::new(params, "enc.gru", s.state + s.condition, s.hidden, 1),
            encoder_head: GaussianHead::new(params, "enc", s.hidden, s.latent, 1e-4),
            step: Mlp::new(params, "step", &[s.condition + s.latent, s.hidden, s.hidden]),
            step_head: GaussianHead::new(params, "step", s.hidden, s.state, s.sd_floor),
        }
    }

    /// Extents.
    pub fn sizes(&self) -> StepwiseSizes {
        self.sizes
    }

    /// Loss of a tile whose x are corrections and whose u are features.
    ///
    /// # Errors
    /// [`TensorError`] if the tile does not have the net's extents.
    pub fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError> {
        let s = self.sizes;
        let x = tape.constant(&[tile.time, s.state, tile.lanes], tile.x)?;
        let u = tape.constant(&[tile.time, s.condition, tile.lanes], tile.u)?;
        let eps = tape.constant(&[1, s.latent, tile.lanes], tile.eps)?;
        let mask = mask_of(tape, &tile)?;
        let q = self.infer(tape, p, x, u, mask)?;
        let noise = tape.mul(eps, q.sd)?;
        let w = tape.add(q.mean, noise)?;
        let zero = tape.scale(eps, 0.0)?;
        let one = tape.shift(zero, 1.0)?;
        let kl = tape.gaussian_kl((q.mean, q.sd), (zero, one))?;
        let kl = tape.sum_all(kl)?;
        let step = self.correct(tape, p, u, w)?;
        let misfit = tape.gaussian_nll(x, step.mean, step.sd)?;
        let misfit = masked_sum(tape, misfit, mask)?;
        Ok(LossVars { total: tape.add(kl, misfit)?, kl, misfit })
    }

    /// Posterior of w `[1, L, lanes]` given corrections and features of a whole trajectory. Training and
    /// reconstruction only.
    ///
    /// # Errors
    /// [`TensorError`] if the extents do not fit.
    pub fn infer<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        x: Var,
        u: Var,
        mask: Option<Var>,
    ) -> Result<Gaussian, TensorError> {
        let seen = tape.concat(&[x, u], 1)?;
        let h = self.encoder.forward(tape, p, seen, &[])?;
        let mean = match mask {
            None => tape.mean(h, 0)?,
            Some(mask) => {
                let visible = tape.mul(h, mask)?;
                let total = tape.sum(visible, 0)?;
                let count = tape.sum(mask, 0)?;
                tape.div(total, count)?
            }
        };
        self.encoder_head.forward(tape, p, mean)
    }

    /// Distribution of the correction `[time, S, lanes]` for features `u [time, U, lanes]` and latents
    /// `w [1, L, lanes]`.
    ///
    /// # Errors
    /// [`TensorError`] if the extents do not fit.
    pub fn correct<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        u: Var,
        w: Var,
    ) -> Result<Gaussian, TensorError> {
        let (time, lanes) = (tape.shape(u).dims()[0], tape.shape(w).dims()[2]);
        let everywhere = augsim_tensor::Shape::new(&[time, self.sizes.latent, lanes])?;
        let w = tape.broadcast_to(w, everywhere)?;
        let input = tape.concat(&[u, w], 1)?;
        let h = self.step.forward(tape, p, input)?;
        self.step_head.forward(tape, p, h)
    }
}
