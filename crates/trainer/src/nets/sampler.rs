//! Sampling from a trained DCVRNN without a tape: prior and decoder, step by step or in blocks of steps.

use super::Dcvrnn;
use augsim_nn::Params;
use augsim_nn::inference::{DrawRunner, GruRunner, LinearRunner, SdRunner};

/// Samples trajectories, one per lane, from prior and decoder of a [`Dcvrnn`].
///
/// Nothing is allocated after construction.
///
/// ```
/// use augsim_data::random_stream;
/// use augsim_nn::Params;
/// use augsim_trainer::nets::{Dcvrnn, DcvrnnSampler, DcvrnnSizes, Decoder};
///
/// let (time, state, condition, latent) = (10, 2, 3, 4);
/// let sizes = DcvrnnSizes { state, condition, latent, hidden: 16, layers: 2, sd_floor: 1e-3, decoder: Decoder::Fixed };
/// let mut params = Params::<f32>::new(random_stream(1, "init", 0));
/// let net = Dcvrnn::new(&mut params, sizes);
/// let mut sampler = DcvrnnSampler::new(&net, &params, 1, time);
///
/// let (u, eps) = (vec![0.1; time * condition], vec![0.5; time * latent]);
/// let at_once = sampler.advance(&u, &eps).mean.to_vec();
/// sampler.reset();
/// for expected in at_once.chunks(state) {
///     let step = sampler.advance(&u[..condition], &eps[..latent]).mean;
///     assert!(step.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6));
/// }
/// ```
#[derive(Debug, Clone)]
pub struct DcvrnnSampler {
    prior: (GruRunner, DrawRunner),
    decoder: GruRunner,
    mean: LinearRunner,
    sd: Option<SdRunner>,
    /// Input rows of the prior's GRU: condition and noise.
    input: Vec<f32>,
    condition: usize,
    latent: usize,
    lanes: usize,
}

/// Predicted distribution of the targets x, `[steps, S, lane]` each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Predicted<'a> {
    /// Mean of the targets.
    pub mean: &'a [f32],
    /// Standard deviation of the targets; `None` where it is fixed to 1.
    pub sd: Option<&'a [f32]>,
}

impl DcvrnnSampler {
    /// Creates a sampler of `net` for `lanes` trajectories and at most `steps` steps per call.
    pub fn new(net: &Dcvrnn, params: &Params<f32>, lanes: usize, steps: usize) -> Self {
        let s = net.sizes();
        let parts = net.generative_parts();
        DcvrnnSampler {
            prior: (
                GruRunner::new(parts.prior, params, lanes, steps),
                DrawRunner::new(parts.prior_head, params, lanes, steps),
            ),
            decoder: GruRunner::new(parts.decoder, params, lanes, steps),
            mean: LinearRunner::new(parts.mean, params, lanes, steps),
            sd: parts.std.map(|std| SdRunner::new(std, s.sd_floor, params, lanes, steps)),
            input: vec![0.0; steps * (s.condition + s.latent) * lanes],
            condition: s.condition,
            latent: s.latent,
            lanes,
        }
    }

    /// Resets the hidden states of the GRUs to the start of a trajectory.
    pub fn reset(&mut self) {
        self.prior.0.reset();
        self.decoder.reset();
    }

    /// Predicts the next steps, with conditions `u [steps, U, lane]`.
    ///
    /// `eps [steps, L, lane]` are standard normal draws.
    ///
    /// The length of `eps` determines the number of steps.
    pub fn advance(&mut self, u: &[f32], eps: &[f32]) -> Predicted<'_> {
        let (u_row, eps_row) = (self.condition * self.lanes, self.latent * self.lanes);
        let steps = eps.len() / eps_row.max(1);
        let input = &mut self.input[..steps * (u_row + eps_row)];
        for (s, row) in input.chunks_exact_mut((u_row + eps_row).max(1)).enumerate() {
            row[..u_row].copy_from_slice(&u[s * u_row..][..u_row]);
            row[u_row..].copy_from_slice(&eps[s * eps_row..][..eps_row]);
        }
        let z = self.prior.1.run(self.prior.0.run(input, steps), eps, steps);
        let h = self.decoder.run(z, steps);
        let sd = self.sd.as_mut().map(|sd| sd.run(h, steps));
        Predicted { mean: self.mean.run(h, steps), sd }
    }
}
