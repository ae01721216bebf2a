//! The nets: their layers, their losses on a batch tile (recorded on a tape), and inference without a tape.

mod dcvrnn;
mod sampler;
mod step_runner;
mod stepwise;
pub(crate) mod tile;

pub use dcvrnn::{Dcvrnn, DcvrnnSizes, Decoder, Extractors};
pub use sampler::{DcvrnnSampler, Predicted};
pub use step_runner::StepRunner;
pub use stepwise::{Stepwise, StepwiseSizes};
pub use tile::{LossVars, Losses, Tile};

use crate::engine::EquationMotion;
use crate::featuriser::width;
use crate::league::{ClassNet, Extents};
use crate::recipe::Recipe;
use crate::settings::{Correction, Settings};
use augsim_nn::{Bound, Params};
use augsim_tensor::{Scalar, Tape, TensorError};

/// The net of a recipe ([`Recipe`]), in one of three architectures.
#[derive(Debug, Clone)]
pub enum Net {
    /// The DCVRNN, for the recipes Neural, Hybrid and Hybrid-std.
    Dcvrnn(Dcvrnn),
    /// The net that corrects step by step, for the recipes Hybrid+ and Neural+.
    Stepwise(Stepwise),
    /// A net or directly fitted model of a class of the benchmark league.
    Class(ClassNet),
}

impl Net {
    /// Builds the net of `settings` for states of `state` columns, and registers its parameters.
    pub fn new<T: Scalar>(settings: &Settings, state: usize, params: &mut Params<T>) -> Self {
        let condition = width(settings, state);
        // For systems of equations only some rates (those of force and flow equations) are corrected, not all
        // states.
        let state = settings.engine.rate_model().map_or(state, EquationMotion::corrected_count);
        if let Some(class) = settings.recipe.class() {
            return Net::Class(ClassNet::new(class, settings, Extents { state, condition }, params));
        }
        let net = settings.net;
        let has_rollouts = settings.correction == Correction::Rollout;
        if matches!(settings.recipe, Recipe::HybridPlus | Recipe::NeuralPlus) {
            let (latent, hidden, sd_floor) = (net.latent, net.hidden, net.sd_floor);
            let physics_parameters =
                if settings.correction == Correction::Step { settings.engine.sensitivity_count() } else { 0 };
            let sizes = StepwiseSizes { state, condition, latent, hidden, sd_floor, physics_parameters };
            return Net::Stepwise(match has_rollouts {
                true => Stepwise::with_memory(params, sizes),
                false => Stepwise::new(params, sizes),
            });
        }
        let sizes = DcvrnnSizes {
            state,
            condition,
            latent: net.latent,
            hidden: net.hidden,
            layers: net.layers,
            sd_floor: net.sd_floor,
            decoder: if has_rollouts { Decoder::Learned } else { Decoder::Fixed },
        };
        let phi = if has_rollouts { Extractors::PUSH } else { Extractors::default() };
        Net::Dcvrnn(Dcvrnn::with_extractors(params, sizes, phi))
    }

    /// Number of rows of noise for a sequence of `time` steps, and number of noise values per row.
    pub fn noise_rows(&self, time: usize) -> (usize, usize) {
        match self {
            Net::Dcvrnn(net) => (time, net.sizes().latent),
            Net::Stepwise(net) => (1, net.sizes().latent),
            Net::Class(net) => net.noise_rows(time),
        }
    }

    /// Number of targets per row, and number of conditions (net inputs) per row.
    pub fn extents(&self) -> (usize, usize) {
        match self {
            Net::Dcvrnn(net) => (net.sizes().state, net.sizes().condition),
            Net::Stepwise(net) => (net.sizes().state, net.sizes().condition),
            Net::Class(net) => (net.extents().state, net.extents().condition),
        }
    }

    /// Whether the class is fitted directly instead of by gradient descent.
    pub(crate) fn is_fitted(&self) -> bool {
        matches!(self, Net::Class(ClassNet::Fitted(..)))
    }

    /// Records the loss of a batch tile (group of trajectories) on the tape.
    ///
    /// # Errors
    /// [`TensorError`] if the tile's shapes do not match the net's sizes.
    pub fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError> {
        match self {
            Net::Dcvrnn(net) => net.loss(tape, p, tile),
            Net::Stepwise(net) => net.loss(tape, p, tile),
            Net::Class(net) => net.loss(tape, p, tile),
        }
    }

    /// Computes the loss of a batch tile (group of trajectories), and `scale` times its gradient.
    /// The gradient is with respect to the parameters `p`, and stays on the tape.
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
        if let Net::Dcvrnn(net) = self {
            return net.differentiate(tape, p, tile, scale);
        }
        let loss = self.loss(tape, p, tile)?;
        tile::backpropagate(tape, loss, scale)
    }
}
