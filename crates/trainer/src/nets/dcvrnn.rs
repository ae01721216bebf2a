//! The decoupled conditional variational recurrent net, DCVRNN (paper, section III).
//!
//! Three recurrent nets whose states do not depend on each other's outputs, so that each processes a whole
//! sequence at once.
//!
//! 1. encoder: GRU(x_t, u_t, eps_t) gives mu_z, sigma_z; z_t = mu_z + eps_t sigma_z
//! 2. prior: GRU(u_t, eps_t) gives mu_0, sigma_0; in a forecast z_t = mu_0 + eps_t sigma_0
//! 3. decoder: GRU(z_t) gives mu_x (and sigma_x, if it is learned)
//! 4. loss = sum over t of KL(N(mu_z, sigma_z) || N(mu_0, sigma_0)) - ln p(x_t | z_t), without constant terms
//!
//! x_t, u_t and z_t first pass through feature extractors (phi_x, phi_u, phi_z), which are the identity for
//! the ball. As in the paper, the same eps_t enters encoder, prior and z_t. So the divergence is conditional
//! on eps and does not bound the information in z; the crate's README explains the effect on forecasts.

use super::tile::{LossVars, Losses, Tile, mask_of, masked_sum};
use augsim_nn::{Bound, Gaussian, GaussianHead, Gru, Linear, Mlp, Params};
use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// How the decoder's standard deviation is determined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decoder {
    /// The standard deviation is fixed to 1 (bouncing ball).
    Fixed,
    /// The standard deviation is learned, through softplus (pushing).
    Learned,
}

/// Sizes of a [`Dcvrnn`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DcvrnnSizes {
    /// Number of state columns, the width of the target x_t.
    pub state: usize,
    /// Number of conditions u_t that the net reads per step.
    pub condition: usize,
    /// Size of the latent z_t.
    pub latent: usize,
    /// Number of units of each GRU layer.
    pub hidden: usize,
    /// Number of GRU layers.
    pub layers: usize,
    /// Lower bound that is added to learned standard deviations, in the net's units.
    pub sd_floor: f64,
    /// How the decoder's standard deviation is determined.
    pub decoder: Decoder,
}

/// Layer widths of the feature extractors (perceptrons before the GRUs), tanh after each; empty for the identity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Extractors {
    /// Layer widths of the extractor phi_x, which reads the targets x_t.
    pub x: &'static [usize],
    /// Layer widths of the extractor phi_u, which reads the conditions u_t.
    pub u: &'static [usize],
    /// Layer widths of the extractor phi_z, which reads the latents z_t.
    pub z: &'static [usize],
}

impl Extractors {
    /// Layer widths of the paper's feature extractors for pushing.
    pub const PUSH: Extractors = Extractors { x: &[32, 16], u: &[32, 16], z: &[16] };
}

/// The DCVRNN: identifiers of its parameters, named as in PyTorch (`enc.gru.weight_ih_l0`, ...).
#[derive(Debug, Clone)]
pub struct Dcvrnn {
    sizes: DcvrnnSizes,
    phi: [Mlp; 3],
    encoder: (Gru, GaussianHead),
    prior: (Gru, GaussianHead),
    decoder: Gru,
    decoder_mean: Linear,
    decoder_std: Option<Linear>,
}

/// Distributions that a forward pass of the DCVRNN computes, all `[time, feature, lane]`.
#[derive(Debug, Clone, Copy)]
pub struct ForwardPass {
    /// Posterior distribution of the latent z.
    pub posterior: Gaussian,
    /// Prior distribution of the latent z.
    pub prior: Gaussian,
    /// Latent z drawn from the posterior.
    pub z: Var,
    /// Mean of the target x given the latent z.
    pub mean_x: Var,
    /// Standard deviation of the target x given the latent z; `None` if it is fixed to 1.
    pub sd_x: Option<Var>,
}

/// Layers that a forecast uses: those of prior and decoder.
pub(super) struct GenerativeParts<'a> {
    pub prior: &'a Gru,
    pub prior_head: GaussianHead,
    pub decoder: &'a Gru,
    pub mean: Linear,
    pub std: Option<Linear>,
}

impl Dcvrnn {
    /// Creates a net without feature extractors and registers its parameters.
    pub fn new<T: Scalar>(params: &mut Params<T>, s: DcvrnnSizes) -> Self {
        Self::with_extractors(params, s, Extractors::default())
    }

    /// Creates a net with feature extractors and registers its parameters (`phi_x.0.weight` and so on).
    pub fn with_extractors<T: Scalar>(params: &mut Params<T>, s: DcvrnnSizes, phi: Extractors) -> Self {
        let mut extractor = |name: &str, inputs: usize, widths: &[usize]| {
            let layers: Vec<usize> = std::iter::once(inputs).chain(widths.iter().copied()).collect();
            (Mlp::new(params, name, &layers), layers.last().copied().unwrap_or(inputs))
        };
        let (phi_x, x) = extractor("phi_x", s.state, phi.x);
        let (phi_u, u) = extractor("phi_u", s.condition, phi.u);
        let (phi_z, z) = extractor("phi_z", s.latent, phi.z);
        let net = |params: &mut Params<T>, name: &str, inputs: usize| {
            let gru = Gru::new(params, &format!("{name}.gru"), inputs, s.hidden, s.layers);
            (gru, GaussianHead::new(params, name, s.hidden, s.latent, s.sd_floor))
        };
        Dcvrnn {
            sizes: s,
            phi: [phi_x, phi_u, phi_z],
            encoder: net(params, "enc", x + u + s.latent),
            prior: net(params, "prior", u + s.latent),
            decoder: Gru::new(params, "dec.gru", z, s.hidden, s.layers),
            decoder_mean: Linear::new(params, "dec.mean", s.hidden, s.state),
            decoder_std: matches!(s.decoder, Decoder::Learned)
                .then(|| Linear::new(params, "dec.std", s.hidden, s.state)),
        }
    }

    /// Sizes of the net: widths of states, conditions, latent and layers.
    pub fn sizes(&self) -> DcvrnnSizes {
        self.sizes
    }

    /// Returns the layers that a forecast uses: those of prior and decoder.
    pub(super) fn generative_parts(&self) -> GenerativeParts<'_> {
        let (prior, prior_head) = &self.prior;
        let (mean, std) = (self.decoder_mean, self.decoder_std);
        GenerativeParts { prior, prior_head: *prior_head, decoder: &self.decoder, mean, std }
    }

    /// Records posterior, prior and decoder on the tape.
    ///
    /// For targets `x [time, S, lanes]`, conditions `u [time, U, lanes]`, noise `eps [time, L, lanes]`; one
    /// trajectory per lane.
    ///
    /// # Errors
    /// [`TensorError`] if the shapes do not match the net's sizes.
    pub fn pass<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        [x, u, eps]: [Var; 3],
    ) -> Result<ForwardPass, TensorError> {
        let u = self.phi[1].forward(tape, p, u)?;
        let posterior = self.posterior(tape, p, [x, u, eps])?;
        let prior = self.prior(tape, p, u, eps)?;
        let z = draw(tape, posterior, eps)?;
        let (mean_x, sd_x) = self.decode(tape, p, z)?;
        Ok(ForwardPass { posterior, prior, z, mean_x, sd_x })
    }

    /// Records the loss of a batch tile on the tape, summed over time and trajectories.
    ///
    /// # Errors
    /// [`TensorError`] if the tile's shapes do not match the net's sizes.
    pub fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError> {
        let [x, u, eps] = self.operands(tape, tile)?;
        let mask = mask_of(tape, &tile)?;
        let passed = self.pass(tape, p, [x, u, eps])?;
        let (kl, total_nll) = self.parts(tape, x, passed)?;
        let kl = masked_sum(tape, kl, mask)?;
        let total_nll = masked_sum(tape, total_nll, mask)?;
        Ok(LossVars { total: tape.add(kl, total_nll)?, kl, negative_ln_likelihood: total_nll })
    }

    /// Computes the loss of a batch tile, and `scale` times its gradient with respect to the parameters `p`.
    ///
    /// Same values as [`Dcvrnn::loss`], but prior and decoder are differentiated and dropped from the tape
    /// one after the other, which saves 33 % of the memory of a tile.
    ///
    /// # Errors
    /// [`TensorError`] if the tile's shapes do not match the net's sizes.
    pub fn differentiate<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
        scale: f64,
    ) -> Result<Losses<T>, TensorError> {
        let [x, u, eps] = self.operands(tape, tile)?;
        let mask = mask_of(tape, &tile)?;
        let u = self.phi[1].forward(tape, p, u)?;
        let q = self.posterior(tape, p, [x, u, eps])?;

        let mark = tape.mark();
        // Sums a term of the loss, backpropagates `scale` times it to the mark, and returns the sum.
        let backward_term = |tape: &mut Tape<T>, term: Var| -> Result<T, TensorError> {
            let sum = masked_sum(tape, term, mask)?;
            let value = tape.value(sum)[0];
            let scaled = tape.scale(sum, scale)?;
            tape.backward_to(mark, scaled)?;
            Ok(value)
        };

        let prior = self.prior(tape, p, u, eps)?;
        let kl = tape.gaussian_kl((q.mean, q.sd), (prior.mean, prior.sd))?;
        let kl = backward_term(tape, kl)?;

        let z = draw(tape, q, eps)?;
        let decoded = self.decode(tape, p, z)?;
        let total_nll = negative_log_likelihood(tape, x, decoded)?;
        let total_nll = backward_term(tape, total_nll)?;

        tape.finish_backward();
        Ok(Losses { kl, negative_ln_likelihood: total_nll })
    }

    /// Records the two parts of the loss on the tape: divergence and negative log-likelihood.
    /// The Kullback-Leibler divergence is `[time, L, lanes]`, the negative log-likelihood `[time, S, lanes]`.
    ///
    /// # Errors
    /// [`TensorError`] if the shapes do not match the net's sizes.
    pub fn parts<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        x: Var,
        passed: ForwardPass,
    ) -> Result<(Var, Var), TensorError> {
        let (q, prior) = (passed.posterior, passed.prior);
        let kl = tape.gaussian_kl((q.mean, q.sd), (prior.mean, prior.sd))?;
        Ok((kl, negative_log_likelihood(tape, x, (passed.mean_x, passed.sd_x))?))
    }

    /// Records a forecast: mean (and standard deviation) of x for latents drawn from the prior, given `u`.
    ///
    /// # Errors
    /// [`TensorError`] if the shapes do not match the net's sizes.
    pub fn generate<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        u: Var,
        eps: Var,
    ) -> Result<(Var, Option<Var>), TensorError> {
        let u = self.phi[1].forward(tape, p, u)?;
        let prior = self.prior(tape, p, u, eps)?;
        let z = draw(tape, prior, eps)?;
        self.decode(tape, p, z)
    }

    /// Records a batch tile's targets, conditions and noise as constants on the tape.
    fn operands<T: Scalar>(&self, tape: &mut Tape<T>, tile: Tile<'_, T>) -> Result<[Var; 3], TensorError> {
        let (s, time, lanes) = (self.sizes, tile.time, tile.lanes);
        Ok([
            tape.constant(&[time, s.state, lanes], tile.x)?,
            tape.constant(&[time, s.condition, lanes], tile.u)?,
            tape.constant(&[time, s.latent, lanes], tile.eps)?,
        ])
    }

    /// Records the posterior of the latent z, given targets, features of conditions, and noise.
    fn posterior<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        [x, u, eps]: [Var; 3],
    ) -> Result<Gaussian, TensorError> {
        let x = self.phi[0].forward(tape, p, x)?;
        let input = tape.concat(&[x, u, eps], 1)?;
        gru_gaussian(tape, p, &self.encoder, input)
    }

    /// Records the prior of the latent z, given features of conditions, and noise.
    fn prior<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        u: Var,
        eps: Var,
    ) -> Result<Gaussian, TensorError> {
        let input = tape.concat(&[u, eps], 1)?;
        gru_gaussian(tape, p, &self.prior, input)
    }

    /// Records mean and standard deviation of the target x for latents z; `None` if the deviation is fixed to 1.
    fn decode<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        z: Var,
    ) -> Result<(Var, Option<Var>), TensorError> {
        let z = self.phi[2].forward(tape, p, z)?;
        let h = self.decoder.forward(tape, p, z, &[])?;
        let mean = self.decoder_mean.forward(tape, p, h)?;
        let Some(std) = self.decoder_std else { return Ok((mean, None)) };
        let raw = std.forward(tape, p, h)?;
        let sd = tape.softplus(raw)?;
        Ok((mean, Some(tape.shift(sd, self.sizes.sd_floor)?)))
    }
}

/// Records a GRU followed by a head that outputs mean and standard deviation.
fn gru_gaussian<T: Scalar>(
    tape: &mut Tape<T>,
    p: &Bound,
    (gru, head): &(Gru, GaussianHead),
    x: Var,
) -> Result<Gaussian, TensorError> {
    let h = gru.forward(tape, p, x, &[])?;
    head.forward(tape, p, h)
}

/// Records a draw from a Gaussian, mean + eps * sd, on the tape.
fn draw<T: Scalar>(tape: &mut Tape<T>, g: Gaussian, eps: Var) -> Result<Var, TensorError> {
    let noise = tape.mul(eps, g.sd)?;
    tape.add(g.mean, noise)
}

/// Records the negative log-likelihood of the target x without constant terms.
/// `sd` is `None` if it is fixed to 1.
fn negative_log_likelihood<T: Scalar>(
    tape: &mut Tape<T>,
    x: Var,
    (mean, sd): (Var, Option<Var>),
) -> Result<Var, TensorError> {
    match sd {
        None => tape.squared_error(x, mean),
        Some(sd) => tape.gaussian_nll(x, mean, sd),
    }
}
