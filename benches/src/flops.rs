//! Counts of floating-point operations of the nets.
//!
//! Only products are counted, a multiply-add as two operations; transcendental functions are not. Training
//! counts the forward pass and both gradients of every product, except gradients with respect to data and
//! noise, which are not computed.

/// Layer sizes of a DCVRNN (recurrent variational network) without feature nets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extents {
    /// Number of state columns of the net.
    pub state: usize,
    /// Number of condition (input) columns of the net.
    pub condition: usize,
    /// Number of latent variables of the net per time step.
    pub latent: usize,
    /// Number of hidden units per layer of the net.
    pub hidden: usize,
}

/// Layer sizes of the Hybrid net for the ball data of the paper.
pub const BALL: Extents = Extents { state: 2, condition: 4, latent: 4, hidden: 16 };

/// Floating-point operations of two stacked GRU layers for one step of one sequence.
fn two_gru_layers(input: usize, hidden: usize) -> usize {
    2 * 3 * hidden * (input + hidden) + 2 * 3 * hidden * (2 * hidden)
}

impl Extents {
    /// Floating-point operations of the forward pass for one step of one sequence.
    fn forward(self) -> usize {
        let Extents { state, condition, latent, hidden } = self;
        let heads = 2 * hidden * (2 * latent + 2 * latent + state);
        let encoder = two_gru_layers(state + condition + latent, hidden);
        encoder + two_gru_layers(condition + latent, hidden) + two_gru_layers(latent, hidden) + heads
    }

    /// Floating-point operations of one training iteration with `batch` sequences of `time` steps.
    pub fn training(self, batch: usize, time: usize) -> f64 {
        let skipped_gradients = 2 * 3 * self.hidden * (self.state + 2 * self.condition + 2 * self.latent);
        ((3 * self.forward() - skipped_gradients) * batch * time) as f64
    }

    /// Floating-point operations of sampling `batch` sequences of `time` steps with prior and decoder.
    pub fn sampling(self, batch: usize, time: usize) -> f64 {
        let Extents { state, condition, latent, hidden } = self;
        let heads = 2 * hidden * (2 * latent + state);
        ((two_gru_layers(condition + latent, hidden) + two_gru_layers(latent, hidden) + heads) * batch * time)
            as f64
    }
}

/// Floating-point operations of one training iteration of [`crate::push::push_net`] (100 x 300 steps).
pub const PUSH_TRAINING: f64 = 2.47e9;
