//! The decoupled conditional variational recurrent net (paper, section III): three recurrent nets that
//! whole sequences run through without waiting for one another.
//!
//! - encoder: GRU(x_t, u_t, eps_t) gives mu_z, sigma_z; z_t = mu_z + eps_t sigma_z
//! - prior: GRU(u_t, eps_t) gives mu_0, sigma_0; in prediction z_t = mu_0 + eps_t sigma_0
//! - decoder: GRU(z_t) gives mu_x (and sigma_x, if it is learned)
//!
//! x_t, u_t and z_t pass through feature extractors first (phi_x, phi_u, phi_z), the identity for the ball.
//!
//! Loss: sum over t of KL(N(mu_z, sigma_z) || N(mu_0, sigma_0)) - ln P(x_t | z_t), less constants. The same
//! eps_t enters encoder, prior and z_t, as the paper writes it; so the divergence is taken given eps and
//! does not bound what z carries. The README of this crate says what that means for forecasts.

use super::tile::{LossVars, Losses, Tile, mask_of, masked_sum};
use augsim_nn::{Bound, Gaussian, GaussianHead, Gru, Linear, Mlp, Params};
use augsim_tensor::{Scalar, Tape, TensorError, Var};

/// The source of the decoder's standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decoder {
    /// Fixed to 1 (bouncing ball).
    Fixed,
    /// Learned, through softplus (pushing).
    Learned,
}

/// Extents of a [`Dcvrnn`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DcvrnnSizes {
    /// State columns: width of x_t.
    pub state: usize,
    /// Width of the condition u_t.
    pub condition: usize,
    /// Width of the latent z_t.
    pub latent: usize,
    /// Units of each GRU layer.
    pub hidden: usize,
    /// GRU layers.
    pub layers: usize,
    /// Added to learned standard deviations.
    pub sd_floor: f64,
    /// The decoder's standard deviation.
    pub decoder: Decoder,
}

/// Widths of the layers of the feature extractors, each followed by tanh; none for the identity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Extractors {
    /// Of targets.
    pub x: &'static [usize],
    /// Of conditions.
    pub u: &'static [usize],
    /// Of latents.
    pub z: &'static [usize],
}

impl Extractors {
    /// The paper's for pushing.
    pub const PUSH: Extractors = Extractors { x: &[32, 16], u: &[32, 16], z: &[16] };
}

/// The net: ids of its parameters, named `enc.gru.weight_ih_l0`, `enc.mean.weight` and so on.
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

/// The distributions that a forward pass gives, all `[time, feature, lane]`.
#[derive(Debug, Clone, Copy)]
pub struct Passed {
    /// Posterior of z.
    pub posterior: Gaussian,
    /// Prior of z.
    pub prior: Gaussian,
    /// z drawn from the posterior.
    pub z: Var,
    /// Mean of x given z.
    pub mean_x: Var,
    /// Standard deviation of x given z; absent where it is 1.
    pub sd_x: Option<Var>,
}

/// The layers that generate.
pub(super) struct Generating<'a> {
    pub prior: &'a Gru,
    pub prior_head: GaussianHead,
    pub decoder: &'a Gru,
    pub mean: Linear,
    pub std: Option<Linear>,
}

impl Dcvrnn {
    /// Registers the parameters of a net without feature extractors.
    pub fn new<T: Scalar>(params: &mut Params<T>, s: DcvrnnSizes) -> Self {
        Self::with_extractors(params, s, Extractors::default())
    }

    /// Registers the parameters; those of the extractors are named `phi_x.0.weight` and so on.
    pub fn with_extractors<T: Scalar>(params: &mut Params<T>, s: DcvrnnSizes, phi: Extractors) -> Self {
        let mut extractor = |name: &str, inputs: usize, widths: &[usize]| {
            let all: Vec<usize> = std::iter::once(inputs).chain(widths.iter().copied()).collect();
            (Mlp::new(params, name, &all), all.last().copied().unwrap_or(inputs))
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

    /// Extents.
    pub fn sizes(&self) -> DcvrnnSizes {
        self.sizes
    }

    /// The parts that a forecast uses: the prior and the decoder.
    pub(super) fn generating(&self) -> Generating<'_> {
        let (prior, prior_head) = &self.prior;
        let (mean, std) = (self.decoder_mean, self.decoder_std);
        Generating { prior, prior_head: *prior_head, decoder: &self.decoder, mean, std }
    }

    /// Posterior, prior and decoder for `x [time, S, lanes]`, `u [time, U, lanes]`, `eps [time, L, lanes]`.
    ///
    /// # Errors
    /// [`TensorError`] if the extents do not fit.
    pub fn pass<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        [x, u, eps]: [Var; 3],
    ) -> Result<Passed, TensorError> {
        let u = self.phi[1].forward(tape, p, u)?;
        let posterior = self.posterior(tape, p, [x, u, eps])?;
        let prior = self.prior(tape, p, u, eps)?;
        let z = draw(tape, posterior, eps)?;
        let (mean_x, sd_x) = self.decode(tape, p, z)?;
        Ok(Passed { posterior, prior, z, mean_x, sd_x })
    }

    /// Loss of a tile: sums over time and lanes.
    ///
    /// # Errors
    /// [`TensorError`] if the tile does not have the net's extents.
    pub fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError> {
        let [x, u, eps] = self.operands(tape, tile)?;
        let mask = mask_of(tape, &tile)?;
        let passed = self.pass(tape, p, [x, u, eps])?;
        let (kl, misfit) = self.parts(tape, x, passed)?;
        let kl = masked_sum(tape, kl, mask)?;
        let misfit = masked_sum(tape, misfit, mask)?;
        Ok(LossVars { total: tape.add(kl, misfit)?, kl, misfit })
    }

    /// Loss of a tile, and `scale` times its gradient at the variables of `p`: as [`Dcvrnn::loss`], but the
    /// prior and the decoder are differentiated and forgotten one after the other, so that a tile takes two
    /// thirds of the memory.
    ///
    /// # Errors
    /// [`TensorError`] if the tile does not have the net's extents.
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
        // The sum of a term of the loss, whose gradient times `scale` is taken back to the mark.
        let differentiate = |tape: &mut Tape<T>, term: Var| -> Result<T, TensorError> {
            let sum = masked_sum(tape, term, mask)?;
            let value = tape.value(sum)[0];
            let scaled = tape.scale(sum, scale)?;
            tape.backward_to(mark, scaled)?;
            Ok(value)
        };

        let prior = self.prior(tape, p, u, eps)?;
        let kl = tape.gaussian_kl((q.mean, q.sd), (prior.mean, prior.sd))?;
        let kl = differentiate(tape, kl)?;

        let z = draw(tape, q, eps)?;
        let decoded = self.decode(tape, p, z)?;
        let misfit = misfit(tape, x, decoded)?;
        let misfit = differentiate(tape, misfit)?;

        tape.finish_backward();
        Ok(Losses { kl, misfit })
    }

    /// Divergence `[time, L, lanes]` and negative log-likelihood `[time, S, lanes]`.
    ///
    /// # Errors
    /// [`TensorError`] if the extents do not fit.
    pub fn parts<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        x: Var,
        passed: Passed,
    ) -> Result<(Var, Var), TensorError> {
        let (q, prior) = (passed.posterior, passed.prior);
        let kl = tape.gaussian_kl((q.mean, q.sd), (prior.mean, prior.sd))?;
        Ok((kl, misfit(tape, x, (passed.mean_x, passed.sd_x))?))
    }

    /// Mean (and deviation) of x for latents drawn from the prior: a forecast, from `u` alone.
    ///
    /// # Errors
    /// [`TensorError`] if the extents do not fit.
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

    /// Records a tile's targets, conditions and noise.
    fn operands<T: Scalar>(&self, tape: &mut Tape<T>, tile: Tile<'_, T>) -> Result<[Var; 3], TensorError> {
        let (s, time, lanes) = (self.sizes, tile.time, tile.lanes);
        Ok([
            tape.constant(&[time, s.state, lanes], tile.x)?,
            tape.constant(&[time, s.condition, lanes], tile.u)?,
            tape.constant(&[time, s.latent, lanes], tile.eps)?,
        ])
    }

    /// For targets, features of conditions, and noise.
    fn posterior<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        [x, u, eps]: [Var; 3],
    ) -> Result<Gaussian, TensorError> {
        let x = self.phi[0].forward(tape, p, x)?;
        let seen = tape.concat(&[x, u, eps], 1)?;
        run(tape, p, &self.encoder, seen)
    }

    fn prior<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        u: Var,
        eps: Var,
    ) -> Result<Gaussian, TensorError> {
        let seen = tape.concat(&[u, eps], 1)?;
        run(tape, p, &self.prior, seen)
    }

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

fn run<T: Scalar>(
    tape: &mut Tape<T>,
    p: &Bound,
    (gru, head): &(Gru, GaussianHead),
    x: Var,
) -> Result<Gaussian, TensorError> {
    let h = gru.forward(tape, p, x, &[])?;
    head.forward(tape, p, h)
}

/// mean + eps * sd.
fn draw<T: Scalar>(tape: &mut Tape<T>, g: Gaussian, eps: Var) -> Result<Var, TensorError> {
    let noise = tape.mul(eps, g.sd)?;
    tape.add(g.mean, noise)
}

/// Negative log-likelihood of x given mean and, where it is not 1, deviation; less constants.
fn misfit<T: Scalar>(tape: &mut Tape<T>, x: Var, (mean, sd): (Var, Option<Var>)) -> Result<Var, TensorError> {
    match sd {
        None => tape.squared_error(x, mean),
        Some(sd) => tape.gaussian_nll(x, mean, sd),
    }
}
