//! Floating-point operations of the nets: products only, a multiply-add counts as two, transcendental
//! functions not counted; for training, forward plus both gradients of every product, without the input
//! gradients that nobody asks for (those of data and noise).

/// Extents of a DCVRNN without feature nets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extents {
    /// State columns.
    pub state: usize,
    /// Condition columns.
    pub condition: usize,
    /// Latent per step.
    pub latent: usize,
    /// Units.
    pub hidden: usize,
}

/// The ball of the paper, Hybrid.
pub const BALL: Extents = Extents { state: 2, condition: 4, latent: 4, hidden: 16 };

/// Two GRU layers, one step of one sequence.
fn grus(input: usize, hidden: usize) -> usize {
    2 * 3 * hidden * (input + hidden) + 2 * 3 * hidden * (2 * hidden)
}

impl Extents {
    /// Forward, one step of one sequence.
    fn forward(self) -> usize {
        let Extents { state, condition, latent, hidden } = self;
        let heads = 2 * hidden * (2 * latent + 2 * latent + state);
        let encoder = grus(state + condition + latent, hidden);
        encoder + grus(condition + latent, hidden) + grus(latent, hidden) + heads
    }

    /// One training iteration.
    pub fn training(self, batch: usize, time: usize) -> f64 {
        let unasked = 2 * 3 * self.hidden * (self.state + 2 * self.condition + 2 * self.latent);
        ((3 * self.forward() - unasked) * batch * time) as f64
    }

    /// Sampling with prior and decoder.
    pub fn sampling(self, batch: usize, time: usize) -> f64 {
        let Extents { state, condition, latent, hidden } = self;
        let heads = 2 * hidden * (2 * latent + state);
        ((grus(condition + latent, hidden) + grus(latent, hidden) + heads) * batch * time) as f64
    }
}

/// One training iteration of [`crate::push::push_net`] with 100 sequences of 300 steps.
pub const PUSH_TRAINING: f64 = 2.47e9;
