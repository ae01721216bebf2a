//! The analytical model with what a discovery says about its restitution: calibrated, and different from drop to drop or
//! from bounce to bounce.

use crate::{Forecaster, Samples, Task, TrainerError};
use augsim_data::random_stream;
use augsim_physics::ball::bullet::{BulletBall, BulletState};
use augsim_physics::effects::ScatterPer;
use rand_distr::{Distribution, StandardNormal};

/// PyBullet's stepping of a ball whose restitution is drawn at random.
#[derive(Debug, Clone, Copy)]
pub struct ScatteredBall {
    /// The engine, with the mean restitution.
    pub ball: BulletBall,
    /// Standard deviation of the restitution.
    pub sd: f64,
    /// What one draw belongs to.
    pub per: ScatterPer,
    /// Seed of the draws.
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
        let mut draw = || -> f64 {
            let xi: f64 = StandardNormal.sample(&mut rng);
            (self.ball.restitution + self.sd * xi).max(0.0)
        };
        for sample in 0..samples {
            let mut ball = BulletBall { restitution: draw(), ..self.ball };
            let mut state =
                BulletState { centre_m: task.start[0] + ball.radius_m, velocity_m_s: task.start[1] };
            for t in 0..task.time {
                if t > 0 {
                    let falling = state.velocity_m_s < 0.0;
                    ball.step(&mut state);
                    if self.per == ScatterPer::Impact && falling && state.velocity_m_s > 0.0 {
                        ball.restitution = draw();
                    }
                }
                values[t * s * samples + sample] = (state.centre_m - ball.radius_m) as f32;
                values[(t * s + 1) * samples + sample] = state.velocity_m_s as f32;
            }
        }
        Ok(Samples { count: samples, values })
    }
}
