//! The true distribution of the generated drops as a forecaster.
//!
//! No forecast from s_0 can be better calibrated.

use crate::{Engine, Forecaster, Samples, Task, TrainerError};
use augsim_data::random_stream;
use augsim_physics::ball::bullet::BulletBall;
use augsim_physics::ball::drop_distribution::DropDistribution;

/// Samples drops from the distribution that generated the paper's data, given the initial state.
#[derive(Debug, Clone, Copy)]
pub struct ExactDistribution {
    /// Distribution that generated the drops: random restitution, and the ball.
    pub law: DropDistribution,
    /// Seed of the random draws of restitutions.
    pub seed: u64,
}

impl Forecaster for ExactDistribution {
    fn name(&self) -> &str {
        "Exact law"
    }

    fn forecast(&self, task: Task<'_>, samples: usize) -> Result<Samples, TrainerError> {
        let s = task.start.len();
        let mut values = vec![0.0; task.time * s * samples];
        let mut rng = random_stream(self.seed, "exact-law", task.index);
        for sample in 0..samples {
            let ball = BulletBall { restitution: self.law.draw_restitution(&mut rng), ..self.law.ball };
            let path = Engine::PybulletBall(ball).rollout(task.start, &[], task.time);
            for (slot, v) in values[sample..].iter_mut().step_by(samples).zip(path) {
                *slot = v as f32;
            }
        }
        Ok(Samples { count: samples, values })
    }
}
