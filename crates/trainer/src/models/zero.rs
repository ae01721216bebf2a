//! Baseline that always predicts zero, the paper's reference for errors.

use crate::{Forecaster, Samples, Task, TrainerError};

/// Predicts 0 for every state at every time (height of the underside 0 m, velocity 0 m/s).
#[derive(Debug, Clone, Copy, Default)]
pub struct Zero;

impl Forecaster for Zero {
    fn name(&self) -> &str {
        "Zero"
    }

    fn is_deterministic(&self) -> bool {
        true
    }

    fn forecast(&self, task: Task<'_>, _: usize) -> Result<Samples, TrainerError> {
        Ok(Samples { count: 1, values: vec![0.0; task.time * task.start.len()] })
    }
}
