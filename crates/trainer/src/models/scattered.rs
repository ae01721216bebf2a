//! A ball whose restitution is a random effect per drop or per bounce, as a discovery may estimate it.

use crate::{Engine, Forecaster, Samples, Task, TrainerError};
use augsim_data::random_stream;
use augsim_physics::ball::bullet::BulletBall;
use augsim_system::ScatterPer;
use rand_distr::{Distribution, StandardNormal};

/// Forecasts with PyBullet's time stepping and a normally distributed restitution, cut off at 0.
#[derive(Debug, Clone, Copy)]
pub struct ScatteredBall {
    /// PyBullet's stepping scheme for the ball, with the mean restitution.
    pub ball: BulletBall,
    /// Standard deviation of the random restitution.
    pub sd: f64,
    /// Whether the restitution is drawn per trajectory or per event (bounce).
    pub per: ScatterPer,
    /// Seed of the random draws of restitutions.
    pub seed: u64,
}

impl Forecaster for ScatteredBall {
    fn name(&self) -> &str {
        "Physics augmented"
    }

    fn forecast(&self, task: Task<'_>, samples: usize) -> Result<Samples, TrainerError> {
        let s = task.start.len();
        let mut values = vec![0.0; task.time * s * samples];
        let mut rng = random_stream(self.seed, "scattered-ball", task.index);
        let mut draw_restitution = || -> f64 {
            let noise: f64 = StandardNormal.sample(&mut rng);
            (self.ball.restitution + self.sd * noise).max(0.0)
        };
        let mut next = vec![0.0; s];
        for sample in 0..samples {
            let engine = |restitution| Engine::PybulletBall(BulletBall { restitution, ..self.ball });
            let mut ball = engine(draw_restitution());
            let mut state = task.start.to_vec();
            for t in 0..task.time {
                if t > 0 {
                    ball.step(&state, &[], &[], &mut next);
                    let is_rebound = state[1] < 0.0 && next[1] > 0.0;
                    if self.per == ScatterPer::Event && is_rebound {
                        ball = engine(draw_restitution());
                    }
                    state.copy_from_slice(&next);
                }
                for (j, v) in state.iter().enumerate() {
                    values[(t * s + j) * samples + sample] = *v as f32;
                }
            }
        }
        Ok(Samples { count: samples, values })
    }
}
