//! A net with the sizes of the paper's net for pushing.
//!
//! 4 states; 4 actions, the first state and the physics simulation as conditions; 16 latent variables;
//! feature nets before each GRU; 300 steps.

use augsim_nn::Params;
use augsim_trainer::nets::{Dcvrnn, DcvrnnSizes, Decoder, Extractors};

/// Creates the net for pushing in `params`; the decoder's standard deviation is 1, as in the peers.
pub fn push_net(params: &mut Params<f32>) -> Dcvrnn {
    let decoder = Decoder::Fixed;
    let sizes =
        DcvrnnSizes { state: 4, condition: 12, latent: 16, hidden: 16, layers: 2, sd_floor: 1e-6, decoder };
    Dcvrnn::with_extractors(params, sizes, Extractors::PUSH)
}
