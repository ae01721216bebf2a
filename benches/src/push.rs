//! The paper's net for pushing, as far as its extents go: 4 states, 4 actions, the first state and the
//! physics roll-out as condition, latent of 16, feature nets before each GRU, 300 steps.

use crate::synthetic::TileNet;
use augsim_nn::{Bound, GaussianHead, Gru, Linear, Mlp, Params};
use augsim_tensor::{Tape, TensorError, Var};

const STATE: usize = 4;
const CONDITION: usize = 12;
const LATENT: usize = 16;
const HIDDEN: usize = 16;

/// Feature nets, encoder, prior and decoder.
#[derive(Debug)]
pub struct PushNet {
    phi_x: Mlp,
    phi_u: Mlp,
    phi_z: Mlp,
    encoder: (Gru, GaussianHead),
    prior: (Gru, GaussianHead),
    decoder: (Gru, Linear),
}

impl PushNet {
    /// Registers the parameters.
    pub fn new(params: &mut Params<f32>) -> Self {
        let mut net = |name: &str, input: usize| {
            let gru = Gru::new(params, &format!("{name}.gru"), input, HIDDEN, 2);
            (gru, GaussianHead::new(params, name, HIDDEN, LATENT, 1e-6))
        };
        let (encoder, prior) = (net("enc", 16 + 16 + LATENT), net("prior", 16 + LATENT));
        PushNet {
            encoder,
            prior,
            phi_x: Mlp::new(params, "phi_x", &[STATE, 32, 16]),
            phi_u: Mlp::new(params, "phi_u", &[CONDITION, 32, 16]),
            phi_z: Mlp::new(params, "phi_z", &[LATENT, 16]),
            decoder: (
                Gru::new(params, "dec.gru", 16, HIDDEN, 2),
                Linear::new(params, "dec.mean", HIDDEN, STATE),
            ),
        }
    }
}

impl TileNet for PushNet {
    fn widths(&self) -> [usize; 3] {
        [STATE, CONDITION, LATENT]
    }

    fn loss(&self, tape: &mut Tape<f32>, p: &Bound, [x, u, eps]: [Var; 3]) -> Result<Var, TensorError> {
        let (fx, fu) = (self.phi_x.forward(tape, p, x)?, self.phi_u.forward(tape, p, u)?);
        let seen = tape.concat(&[fx, fu, eps], 1)?;
        let h = self.encoder.0.forward(tape, p, seen, &[])?;
        let q = self.encoder.1.forward(tape, p, h)?;
        let seen = tape.concat(&[fu, eps], 1)?;
        let h = self.prior.0.forward(tape, p, seen, &[])?;
        let prior = self.prior.1.forward(tape, p, h)?;
        let noise = tape.mul(eps, q.sd)?;
        let z = tape.add(q.mean, noise)?;
        let z = self.phi_z.forward(tape, p, z)?;
        let h = self.decoder.0.forward(tape, p, z, &[])?;
        let mean = self.decoder.1.forward(tape, p, h)?;
        let kl = tape.gaussian_kl((q.mean, q.sd), (prior.mean, prior.sd))?;
        let misfit = tape.squared_error(x, mean)?;
        let (kl, misfit) = (tape.sum_all(kl)?, tape.sum_all(misfit)?);
        tape.add(kl, misfit)
    }
}
