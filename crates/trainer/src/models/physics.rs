//! The physics engine alone, as a baseline.

use crate::{Engine, Forecaster, Samples, Task, TrainerError};

/// Forecasts by simulating the physics engine from the initial state, without a net.
#[derive(Debug, Clone)]
pub struct Physics(
    /// The physics engine that is simulated.
    pub Engine,
);

impl Forecaster for Physics {
    fn name(&self) -> &str {
        "Physics"
    }

    fn is_deterministic(&self) -> bool {
        true
    }

    fn forecast(&self, task: Task<'_>, _: usize) -> Result<Samples, TrainerError> {
        let path = self.0.rollout(task.start, task.actions, task.time);
        Ok(Samples { count: 1, values: path.into_iter().map(|v| v as f32).collect() })
    }
}
