//! PyBullet's ball with a restitution that differs from drop to drop, as a law of steps: the data's own law, or what a discovery
//! found.

use super::{Moments, StepLaw};
use crate::TrainerError;
use augsim_physics::ball::bullet::{BulletBall, BulletState};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// The ball, with N(mean, sd) for its restitution; a negative one acts as 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestitutionLaw {
    /// Everything but the restitution.
    pub ball: BulletBall,
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sd: f64,
}

impl StepLaw for RestitutionLaw {
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

    fn log_density(&self, latent: &[f64]) -> f64 {
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
