//! PyBullet's ball with a random restitution per drop as a transition model.

use super::{FittedDrop, FreeParameters, Moments, Sensor, TransitionModel};
use crate::{Sequence, Sequences, TrainerError};
use augsim_physics::ball::bullet::{BulletBall, BulletState};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

/// Number of rows of a training drop to which its restitution is fitted.
/// After the second rebound the cost of a restitution has many minima, because how deep an impact falls
/// within a step decides the next one.
const FITTED_ROWS: usize = 80;
/// Assumed measurement noise when training drops are fitted, m and m/s: files carry six digits.
const FIT_SD: f64 = 1e-5;

/// A ball whose restitution is drawn from N(mean, sd) for each trajectory; negative values act as 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RandomRestitution {
    /// The ball's engine, with all parameters but the restitution.
    pub ball: BulletBall,
    /// Mean of the random restitution.
    pub mean: f64,
    /// Standard deviation of the random restitution.
    pub sd: f64,
}

impl RandomRestitution {
    /// Fits the distribution of the restitution to a set of drops.
    /// The damping is the median over drops; mean and standard deviation are those of the restitutions
    /// fitted with it. All other parameters stay as declared.
    pub fn fitted(ball: BulletBall, train: &Sequences) -> Self {
        let sensor = Sensor::with_sd([FIT_SD; 2]);
        let fit = |ball: BulletBall, freedom: FreeParameters| -> Vec<BulletBall> {
            let drop = FittedDrop { ball, freedom };
            let fit_drop = |q: &Sequence| drop.fitted(&q.states[..2 * FITTED_ROWS.min(q.time)], &sensor);
            train.items.par_iter().map(fit_drop).collect()
        };
        let mut dampings: Vec<f64> =
            fit(ball, FreeParameters::Calibrated).iter().map(|b| b.damping).collect();
        dampings.sort_by(f64::total_cmp);
        let damping = dampings.get(dampings.len() / 2).copied().unwrap_or(ball.damping);
        let ball = BulletBall { damping, ..ball };
        let restitutions: Vec<f64> =
            fit(ball, FreeParameters::Restitution).iter().map(|b| b.restitution).collect();
        let n = restitutions.len().max(1) as f64;
        let mean = restitutions.iter().sum::<f64>() / n;
        let variance = restitutions.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        RandomRestitution { ball, mean, sd: variance.sqrt() }
    }
}

impl TransitionModel for RandomRestitution {
    fn latent_dim(&self) -> usize {
        1
    }

    fn state_dim(&self) -> usize {
        2
    }

    fn draw(&self, count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        let mut draw = || -> f64 { StandardNormal.sample(rng) };
        (0..count).map(|_| self.mean + self.sd * draw()).collect()
    }

    fn log_density(&mut self, latent: &[f64]) -> f64 {
        -0.5 * ((latent[0] - self.mean) / self.sd).powi(2)
    }

    fn advance(
        &mut self,
        states: &[f64],
        latents: &[f64],
        _: [&[f64]; 2],
        next: Moments<'_>,
    ) -> Result<(), TrainerError> {
        let radius = self.ball.radius_m;
        for ((now, restitution), next) in
            states.chunks_exact(2).zip(latents).zip(next.mean.chunks_exact_mut(2))
        {
            let mut state = BulletState { centre_m: now[0] + radius, velocity_m_s: now[1] };
            self.ball.step_with(*restitution, &mut state);
            next.copy_from_slice(&[state.centre_m - radius, state.velocity_m_s]);
        }
        next.variance.fill(0.0);
        Ok(())
    }
}
