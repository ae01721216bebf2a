//! Hybrid+: physics step by step, one latent per trajectory, learned deviations.
//!
//! Where the paper's net rolls the physics out from s_0 alone and corrects the whole curve, this one asks
//! the physics for one step from the state that was predicted last and corrects that step:
//! s_{t+1} ~ N(f_p(s_t) + k mu(c_t, w), k sigma(c_t, w)), with c_t features of s_t and f_p(s_t), and a unit k
//! that grows with how far the physics moves in this step.
//! Properties that differ from trajectory to trajectory and cannot be seen at t = 0 (the restitution, say) are the
//! latent w, one draw per trajectory. An encoder infers w from the whole trajectory during training only;
//! a forecast draws w from a Gaussian fitted to what the encoder gave on the training set (ex-post density
//! estimation, Ghosh et al. 2020), because the divergence of one latent hardly weighs against the
//! likelihood of hundreds of steps.
//!
//! Where the engine tells how a step changes with parameters that are likely to be a trajectory's own (d_p f_p, a restitution's),
//! w also moves these: the mean has sum over p of (A w + b)_p d_p f_p besides, so that the product of a drop's restitution and the
//! speed of an impact is the physics' and not the perceptron's. The encoder reads the regression of the corrections on d_p f_p.
//!
//! Loss: k KL(q(w | trajectory) || N(0, I)) - sum over t of v_t ln P(s_{t+1} | s_t, w), less constants, where
//! v_t is the predicted variance, held constant (beta-NLL with beta = 1, Seitzer et al. 2022). With v_t = 1 the
//! net learns to call an impact unpredictable and stops learning it (and never uses w): measured on the
//! ball, 53 % error instead of 19 %.
//!
//! With a memory (pushing) a GRU reads the features first, and what is corrected is the physics' whole roll-out
//! instead of one step: measured poses are too noisy to start a step from, and an object that coasts has a velocity
//! that its pose does not show.

use super::tile::{LossVars, Tile, mask_of, masked_sum};
use augsim_nn::{Bound, Gaussian, GaussianHead, Gru, Linear, Mlp, Params};
use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// Weight k of the divergence: small, since the weighted likelihood is small too.
const KL_WEIGHT: f64 = 0.01;
/// The same with a memory. What a push shows at its start the latent must not carry: with 0.01 the forecasts' errors
/// are a seventh larger (2,000 pushes: 1.5 against 1.3 mm).
const KL_WEIGHT_MEMORY: f64 = 0.3;
/// The same where the latent moves parameters of the physics: the noise of its posterior counts as a decoder's error, and with
/// 0.01 that alone is 0.01 m/s at an impact.
const KL_WEIGHT_OWN: f64 = 0.001;

/// Sum of squared changes below which a trajectory tells nothing of an own parameter: a ball that never touches the ground.
const NO_CHANGE: f64 = 1e-6;

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
    /// Parameters P of the physics that the latent moves; the last P S features are the changes of a step by them.
    pub own: usize,
}

/// The net: an encoder that weighs the steps of a trajectory by what they tell (attention pooling over a
/// set of steps), and a perceptron for the correction of a step.
#[derive(Debug, Clone)]
pub struct Stepwise {
    sizes: StepwiseSizes,
    memory: Option<Gru>,
    encoder: Mlp,
    encoder_weight: Linear,
    encoder_head: GaussianHead,
    step: Mlp,
    step_head: GaussianHead,
    /// From the latent to parameters of the physics.
    own: Option<Linear>,
}

impl Stepwise {
    /// Registers the parameters of a net without memory.
    pub fn new<T: Scalar>(params: &mut Params<T>, s: StepwiseSizes) -> Self {
        Self::assemble(params, s, None, s.condition)
    }

    /// Registers the parameters of a net that reads its features through a GRU of `s.hidden` units.
    pub fn with_memory<T: Scalar>(params: &mut Params<T>, s: StepwiseSizes) -> Self {
        let memory = Gru::new(params, "memory", s.condition, s.hidden, 1);
        Self::assemble(params, s, Some(memory), s.hidden)
    }

    fn assemble<T: Scalar>(
        params: &mut Params<T>,
        s: StepwiseSizes,
        memory: Option<Gru>,
        read: usize,
    ) -> Self {
        Stepwise {
            sizes: s,
            memory,
            encoder: Mlp::new(params, "enc.step", &[s.state + read, s.hidden, s.hidden]),
            encoder_weight: Linear::new(params, "enc.weight", s.hidden, 1),
            encoder_head: GaussianHead::new(params, "enc", s.hidden + s.own, s.latent, 1e-4),
            step: Mlp::new(params, "step", &[read + s.latent, s.hidden, s.hidden]),
            step_head: GaussianHead::new(params, "step", s.hidden, s.state, s.sd_floor),
            own: (s.own > 0).then(|| Linear::new(params, "own", s.latent, s.own)),
        }
    }

    /// Extents.
    pub fn sizes(&self) -> StepwiseSizes {
        self.sizes
    }

    /// The correction of a step: layers, the head behind them, and the layer that moves parameters of the physics.
    pub(super) fn decoder(&self) -> (&Mlp, GaussianHead, Option<Linear>) {
        (&self.step, self.step_head, self.own)
    }

    fn kl_weight(&self) -> f64 {
        match (&self.memory, &self.own) {
            (Some(_), _) => KL_WEIGHT_MEMORY,
            (None, Some(_)) => KL_WEIGHT_OWN,
            (None, None) => KL_WEIGHT,
        }
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
        let u = self.remember(tape, p, u)?;
        let q = self.infer(tape, p, x, u, mask)?;
        let noise = tape.mul(eps, q.sd)?;
        let w = tape.add(q.mean, noise)?;
        let zero = tape.scale(eps, 0.0)?;
        let one = tape.shift(zero, 1.0)?;
        let kl = tape.gaussian_kl((q.mean, q.sd), (zero, one))?;
        let kl = tape.sum_all(kl)?;
        let step = self.correct(tape, p, u, w)?;
        let misfit = tape.gaussian_nll(x, step.mean, step.sd)?;
        let sd = tape.detach(step.sd)?;
        let variance = tape.mul(sd, sd)?;
        let tempered = tape.mul(misfit, variance)?;
        let tempered = masked_sum(tape, tempered, mask)?;
        let misfit = masked_sum(tape, misfit, mask)?;
        let weighted = tape.scale(kl, self.kl_weight())?;
        Ok(LossVars { total: tape.add(weighted, tempered)?, kl, misfit })
    }

    /// The net's reading of features `u [time, U, lanes]`: the memory's states `[time, hidden, lanes]`, or the features themselves.
    ///
    /// # Errors
    /// [`TensorError`] if the extents do not fit.
    pub fn remember<T: Scalar>(&self, tape: &mut Tape<T>, p: &Bound, u: Var) -> Result<Var, TensorError> {
        match &self.memory {
            Some(gru) => gru.forward(tape, p, u, &[]),
            None => Ok(u),
        }
    }

    /// Posterior of w `[1, L, lanes]` given corrections and what is read of a whole trajectory. Training and
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
        let h = self.encoder.forward(tape, p, seen)?;
        let weight = self.encoder_weight.forward(tape, p, h)?;
        let weight = tape.exp(weight)?;
        let weight = match mask {
            None => weight,
            Some(mask) => tape.mul(weight, mask)?,
        };
        let weighted = tape.mul(h, weight)?;
        let total = tape.sum(weighted, 0)?;
        let norm = tape.sum(weight, 0)?;
        let mut pooled = tape.div(total, norm)?;
        for i in 0..self.sizes.own {
            let changes = self.changes(tape, u, i)?;
            let changes = mask.map_or(Ok(changes), |mask| tape.mul(changes, mask))?;
            let shift = regression(tape, x, changes)?;
            pooled = tape.concat(&[pooled, shift], 1)?;
        }
        self.encoder_head.forward(tape, p, pooled)
    }

    /// The changes `[time, S, lanes]` of steps by own parameter `i`, among what is read, `u`.
    fn changes<T: Scalar>(&self, tape: &mut Tape<T>, u: Var, i: usize) -> Result<Var, TensorError> {
        let StepwiseSizes { state, condition, own, .. } = self.sizes;
        let first = condition - (own - i) * state;
        tape.slice(u, 1, first, first + state)
    }

    /// Distribution of the correction `[time, S, lanes]` for what is read, `u [time, U, lanes]`, and latents
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
        let moved = self.move_parameters(tape, p, u, w)?;
        let everywhere = augsim_tensor::Shape::new(&[time, self.sizes.latent, lanes])?;
        let w = tape.broadcast_to(w, everywhere)?;
        let input = tape.concat(&[u, w], 1)?;
        let h = self.step.forward(tape, p, input)?;
        let step = self.step_head.forward(tape, p, h)?;
        let mean = moved.map_or(Ok(step.mean), |moved| tape.add(step.mean, moved))?;
        Ok(Gaussian { mean, sd: step.sd })
    }

    /// The correction `[time, S, lanes]` that moving parameters of the physics makes.
    fn move_parameters<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        u: Var,
        w: Var,
    ) -> Result<Option<Var>, TensorError> {
        let Some(own) = &self.own else { return Ok(None) };
        let shifts = own.forward(tape, p, w)?;
        let mut total = None;
        for i in 0..self.sizes.own {
            let changes = self.changes(tape, u, i)?;
            let shift = tape.slice(shifts, 1, i, i + 1)?;
            let moved = tape.mul(changes, shift)?;
            total = Some(total.map_or(Ok(moved), |total| tape.add(total, moved))?);
        }
        Ok(total)
    }
}

/// The shift `[1, 1, lanes]` of a parameter that accounts for most of the corrections `x [time, S, lanes]`: their regression on the
/// changes that it makes.
fn regression<T: Scalar>(tape: &mut Tape<T>, x: Var, changes: Var) -> Result<Var, TensorError> {
    let mut sum = |a: Var, b: Var| -> Result<Var, TensorError> {
        let product = tape.mul(a, b)?;
        let over_time = tape.sum(product, 0)?;
        tape.sum(over_time, 1)
    };
    let (along, square) = (sum(changes, x)?, sum(changes, changes)?);
    let square = tape.shift(square, NO_CHANGE)?;
    tape.div(along, square)
}
