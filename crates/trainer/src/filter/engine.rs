//! The physics engine as a transition model: only the state is unknown.

use super::{Moments, TransitionModel};
use crate::TrainerError;
use crate::engine::Engine;
use rand_xoshiro::Xoshiro256PlusPlus;

/// A physics engine with known parameters as a transition model; the only unknown is the state.
#[derive(Debug, Clone)]
pub struct EngineTransition<'e> {
    engine: &'e Engine,
    states: usize,
}

impl<'e> EngineTransition<'e> {
    /// Creates the transition model of `engine`.
    pub fn new(engine: &'e Engine) -> Self {
        EngineTransition { states: engine.columns().len(), engine }
    }
}

impl TransitionModel for EngineTransition<'_> {
    fn latent_dim(&self) -> usize {
        0
    }

    fn state_dim(&self) -> usize {
        self.states
    }

    fn draw(&self, _: usize, _: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        Vec::new()
    }

    fn log_density(&mut self, _: &[f64]) -> f64 {
        0.0
    }

    fn advance(
        &mut self,
        states: &[f64],
        _: &[f64],
        [from, to]: [&[f64]; 2],
        next: Moments<'_>,
    ) -> Result<(), TrainerError> {
        let lanes = states.chunks_exact(self.states).zip(next.mean.chunks_exact_mut(self.states));
        lanes.for_each(|(now, next)| self.engine.step(now, from, to, next));
        next.variance.fill(0.0);
        Ok(())
    }
}
