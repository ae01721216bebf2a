//! Hybrid+: corrects physics step by step, with one latent per trajectory.
//!
//! The paper's net rolls the physics out from s_0 and corrects the whole curve. This net instead corrects one
//! physics step f_p at a time, from the last predicted state:
//! 1. s_{t+1} ~ N(f_p(s_t) + k_t mu(c_t, w), (k_t sigma(c_t, w))^2), with c_t features of s_t and f_p(s_t),
//!    and a unit k_t that grows with the size of the physics step (`steps.rs`).
//!
//! The latent w stands for properties that differ between trajectories and are not observable at t = 0, such
//! as the restitution. During training an encoder infers q(w | trajectory). A forecast draws w from a
//! Gaussian fitted to the posteriors of the training set (ex-post density estimation, Ghosh et al. 2020), not
//! from N(0, I): the divergence of one latent has little weight against the likelihood of hundreds of steps,
//! so the posteriors do not match N(0, I).
//!
//! If the engine provides D_q, the first-order change of a step per typical spread of a trajectory-specific
//! physics parameter q (the restitution):
//! 2. mu has the additional term sum over q of (A w + b)_q D_q / k_t, so that the product of restitution and
//!    impact speed comes from the physics and need not be learned by the perceptron. The encoder additionally
//!    reads the regression coefficient of the corrections on D_q / k_t.
//!
//! Loss, without constant terms:
//! 3. lambda KL(q(w | trajectory) || N(0, I)) - sum over t of v_t ln p(s_{t+1} | s_t, w), with v_t the
//!    predicted variance, treated as a constant (beta-NLL with beta = 1, Seitzer et al. 2022). With v_t = 1
//!    the net predicts a large variance at impacts, stops learning them and ignores w: 53 % error on the ball
//!    instead of 19 %.
//!
//! With a memory (pushing) a GRU processes the features first, and the whole physics roll-out is corrected
//! instead of one step, because measured poses are too noisy to start a step from and do not contain the
//! object's velocity.

use super::tile::{LossVars, Tile, mask_of, masked_sum};
use augsim_nn::{Bound, Gaussian, GaussianHead, Gru, Linear, Mlp, Params};
use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// Weight lambda of the KL divergence in the loss (formula 3); small because the weighted likelihood is small too.
const KL_WEIGHT: f64 = 0.01;
/// Weight lambda of the KL divergence for a net with memory (GRU).
///
/// Larger, so that the latent does not encode what the roll-out already shows. With 0.01 the forecast errors
/// of 2,000 pushes are 1.5 mm instead of 1.3 mm.
const KL_WEIGHT_MEMORY: f64 = 0.3;
/// Weight lambda of the KL divergence if the latent shifts physics parameters.
///
/// Smaller, because the noise of the posterior becomes an error of the decoder. With 0.01 that noise alone
/// gives an error of 0.01 m/s at an impact.
const KL_WEIGHT_PHYSICS: f64 = 0.001;

/// Ridge of the regression on the sensitivity D_q, for trajectories where the sensitivity is 0.
///
/// For example a ball that never touches the ground.
const REGRESSION_RIDGE: f64 = 1e-6;

/// Sizes of a [`Stepwise`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepwiseSizes {
    /// Number of state columns, the width of a correction.
    pub state: usize,
    /// Number of features c_t that the net reads per step.
    pub condition: usize,
    /// Size of the latent w of a trajectory.
    pub latent: usize,
    /// Number of units of each hidden layer.
    pub hidden: usize,
    /// Lower bound that is added to learned standard deviations, in units of the corrections.
    pub sd_floor: f64,
    /// Number P of physics parameters that the latent shifts.
    ///
    /// The last P S features are the sensitivities D_q / k_t (S state columns per parameter).
    pub physics_parameters: usize,
}

/// The Hybrid+ net: an encoder with attention pooling over steps, and a perceptron as decoder.
#[derive(Debug, Clone)]
pub struct Stepwise {
    sizes: StepwiseSizes,
    memory: Option<Gru>,
    encoder: Mlp,
    encoder_weight: Linear,
    encoder_head: GaussianHead,
    step: Mlp,
    step_head: GaussianHead,
    /// Layer from the latent to shifts of physics parameters (formula 2); `None` without such parameters.
    shifts: Option<Linear>,
}

impl Stepwise {
    /// Creates a net without memory (GRU) and registers its parameters.
    pub fn new<T: Scalar>(params: &mut Params<T>, s: StepwiseSizes) -> Self {
        Self::assemble(params, s, None, s.condition)
    }

    /// Creates a net that reads its features through a GRU of `s.hidden` units, and registers its parameters.
    pub fn with_memory<T: Scalar>(params: &mut Params<T>, s: StepwiseSizes) -> Self {
        let memory = Gru::new(params, "memory", s.condition, s.hidden, 1);
        Self::assemble(params, s, Some(memory), s.hidden)
    }

    /// Creates the layers and registers their parameters; `inputs` is what encoder and decoder read per step.
    fn assemble<T: Scalar>(
        params: &mut Params<T>,
        s: StepwiseSizes,
        memory: Option<Gru>,
        inputs: usize,
    ) -> Self {
        Stepwise {
            sizes: s,
            memory,
            encoder: Mlp::new(params, "enc.step", &[s.state + inputs, s.hidden, s.hidden]),
            encoder_weight: Linear::new(params, "enc.weight", s.hidden, 1),
            encoder_head: GaussianHead::new(params, "enc", s.hidden + s.physics_parameters, s.latent, 1e-4),
            step: Mlp::new(params, "step", &[inputs + s.latent, s.hidden, s.hidden]),
            step_head: GaussianHead::new(params, "step", s.hidden, s.state, s.sd_floor),
            shifts: (s.physics_parameters > 0)
                .then(|| Linear::new(params, "own", s.latent, s.physics_parameters)),
        }
    }

    /// Sizes of the net: widths of states, features, latent and layers.
    pub fn sizes(&self) -> StepwiseSizes {
        self.sizes
    }

    /// Layers of the decoder: perceptron, Gaussian head, and the layer that shifts physics parameters.
    pub(super) fn decoder(&self) -> (&Mlp, GaussianHead, Option<Linear>) {
        (&self.step, self.step_head, self.shifts)
    }

    fn kl_weight(&self) -> f64 {
        match (&self.memory, &self.shifts) {
            (Some(_), _) => KL_WEIGHT_MEMORY,
            (None, Some(_)) => KL_WEIGHT_PHYSICS,
            (None, None) => KL_WEIGHT,
        }
    }

    /// Records the loss of a batch tile (formula 3), whose `x` are corrections and whose `u` are features.
    ///
    /// # Errors
    /// [`TensorError`] if the tile's shapes do not match the net's sizes.
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
        let u = self.read_features(tape, p, u)?;
        let q = self.infer_latent(tape, p, x, u, mask)?;
        let noise = tape.mul(eps, q.sd)?;
        let w = tape.add(q.mean, noise)?;
        let zero = tape.scale(eps, 0.0)?;
        let one = tape.shift(zero, 1.0)?;
        let kl = tape.gaussian_kl((q.mean, q.sd), (zero, one))?;
        let kl = tape.sum_all(kl)?;
        let step = self.correct(tape, p, u, w)?;
        let total_nll = tape.gaussian_nll(x, step.mean, step.sd)?;
        // beta-NLL: the variance weights the likelihood but is not differentiated.
        let sd = tape.detach(step.sd)?;
        let variance = tape.mul(sd, sd)?;
        let weighted_nll = tape.mul(total_nll, variance)?;
        let weighted_nll = masked_sum(tape, weighted_nll, mask)?;
        let total_nll = masked_sum(tape, total_nll, mask)?;
        let weighted_kl = tape.scale(kl, self.kl_weight())?;
        Ok(LossVars { total: tape.add(weighted_kl, weighted_nll)?, kl, negative_ln_likelihood: total_nll })
    }

    /// Passes features `u [time, U, lanes]` through the net's memory (GRU), if any.
    ///
    /// The result is `[time, hidden, lanes]` with a memory, else `u`.
    ///
    /// # Errors
    /// [`TensorError`] if the shapes do not match the net's sizes.
    pub fn read_features<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        u: Var,
    ) -> Result<Var, TensorError> {
        match &self.memory {
            Some(gru) => gru.forward(tape, p, u, &[]),
            None => Ok(u),
        }
    }

    /// Records the posterior of the latent w `[1, L, lanes]` given corrections `x` and inputs `u`.
    ///
    /// Used for training and reconstruction only; `u` comes from [`read_features`](Self::read_features).
    ///
    /// # Errors
    /// [`TensorError`] if the shapes do not match the net's sizes.
    pub fn infer_latent<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        x: Var,
        u: Var,
        mask: Option<Var>,
    ) -> Result<Gaussian, TensorError> {
        let input = tape.concat(&[x, u], 1)?;
        let h = self.encoder.forward(tape, p, input)?;
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
        for i in 0..self.sizes.physics_parameters {
            let sensitivity = self.sensitivity(tape, u, i)?;
            let sensitivity = mask.map_or(Ok(sensitivity), |mask| tape.mul(sensitivity, mask))?;
            let shift = regression(tape, x, sensitivity)?;
            pooled = tape.concat(&[pooled, shift], 1)?;
        }
        self.encoder_head.forward(tape, p, pooled)
    }

    /// Slices the sensitivities `[time, S, lanes]` to physics parameter `i` from the inputs `u`, S state columns.
    fn sensitivity<T: Scalar>(&self, tape: &mut Tape<T>, u: Var, i: usize) -> Result<Var, TensorError> {
        let StepwiseSizes { state, condition, physics_parameters, .. } = self.sizes;
        let first = condition - (physics_parameters - i) * state;
        tape.slice(u, 1, first, first + state)
    }

    /// Records mean and standard deviation of the corrections, `[time, S, lanes]`, on the tape.
    ///
    /// For inputs `u [time, U, lanes]` and latents `w [1, L, lanes]`.
    ///
    /// # Errors
    /// [`TensorError`] if the shapes do not match the net's sizes.
    pub fn correct<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        u: Var,
        w: Var,
    ) -> Result<Gaussian, TensorError> {
        let (time, lanes) = (tape.shape(u).dims()[0], tape.shape(w).dims()[2]);
        let shift = self.parameter_correction(tape, p, u, w)?;
        let shape = augsim_tensor::Shape::new(&[time, self.sizes.latent, lanes])?;
        let w = tape.broadcast_to(w, shape)?;
        let input = tape.concat(&[u, w], 1)?;
        let h = self.step.forward(tape, p, input)?;
        let step = self.step_head.forward(tape, p, h)?;
        let mean = shift.map_or(Ok(step.mean), |shift| tape.add(step.mean, shift))?;
        Ok(Gaussian { mean, sd: step.sd })
    }

    /// Records the correction `[time, S, lanes]` that results from shifts of physics parameters (formula 2).
    /// `None` if the latent shifts no parameter.
    fn parameter_correction<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        u: Var,
        w: Var,
    ) -> Result<Option<Var>, TensorError> {
        let Some(layer) = &self.shifts else { return Ok(None) };
        let shifts = layer.forward(tape, p, w)?;
        let mut total = None;
        for i in 0..self.sizes.physics_parameters {
            let sensitivity = self.sensitivity(tape, u, i)?;
            let shift = tape.slice(shifts, 1, i, i + 1)?;
            let term = tape.mul(sensitivity, shift)?;
            total = Some(total.map_or(Ok(term), |total| tape.add(total, term))?);
        }
        Ok(total)
    }
}

/// Records the regression coefficient `[1, 1, lanes]` of `x [time, S, lanes]` on `sensitivity`, per trajectory.
fn regression<T: Scalar>(tape: &mut Tape<T>, x: Var, sensitivity: Var) -> Result<Var, TensorError> {
    let mut sum = |a: Var, b: Var| -> Result<Var, TensorError> {
        let product = tape.mul(a, b)?;
        let over_time = tape.sum(product, 0)?;
        tape.sum(over_time, 1)
    };
    let (product, square) = (sum(sensitivity, x)?, sum(sensitivity, sensitivity)?);
    let square = tape.shift(square, REGRESSION_RIDGE)?;
    tape.div(product, square)
}
