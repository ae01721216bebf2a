//! Baseline that predicts no motion.

use crate::{Forecaster, Samples, Task, TrainerError};

/// Predicts the initial state at all times, as a baseline.
#[derive(Debug, Clone, Copy, Default)]
pub struct Still;

impl Forecaster for Still {
    fn name(&self) -> &str {
        "Still"
    }

    fn is_deterministic(&self) -> bool {
        true
    }

    fn forecast(&self, task: Task<'_>, _: usize) -> Result<Samples, TrainerError> {
        let start: Vec<f32> = task.start.iter().map(|v| *v as f32).collect();
        Ok(Samples { count: 1, values: start.repeat(task.time) })
    }
}
