//! The decoder of Hybrid+ without a tape: corrections of single physics steps, many at once.

use super::Stepwise;
use augsim_nn::Params;
use augsim_nn::inference::{GaussianRunner, MlpRunner};

/// The decoder of a [`Stepwise`] net without memory, for a number of steps in lanes. Nothing is allocated after construction.
#[derive(Debug, Clone)]
pub struct StepRunner {
    step: MlpRunner,
    head: GaussianRunner,
    read: Vec<f32>,
    condition: usize,
    lanes: usize,
}

impl StepRunner {
    /// The decoder of `net` for `lanes` steps at once.
    pub fn new(net: &Stepwise, params: &Params<f32>, lanes: usize) -> Self {
        let sizes = net.sizes();
        let (step, head) = net.decoder();
        StepRunner {
            step: MlpRunner::new(step, params, lanes, 1),
            head: GaussianRunner::new(head, params, lanes, 1),
            read: vec![0.0; (sizes.condition + sizes.latent) * lanes],
            condition: sizes.condition,
            lanes,
        }
    }

    /// Steps at once.
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// Where the features `[U, lane]` and the latents `[L, lane]` of the next call are written.
    pub fn input(&mut self) -> (&mut [f32], &mut [f32]) {
        self.read.split_at_mut(self.condition * self.lanes)
    }

    /// Mean and standard deviation `[S, lane]` of the corrections for what [`input`](Self::input) holds.
    pub fn run(&mut self) -> (&[f32], &[f32]) {
        self.head.run(self.step.run(&self.read, 1), 1)
    }
}
