//! PyBullet's stepping scheme as the nets use it.

use super::ball::COLUMNS;
use super::motion::Motion;
use augsim_data::checks::Expected;
use augsim_physics::ball::bullet::{BulletBall, BulletState};

impl Motion for BulletBall {
    fn columns(&self) -> Vec<&str> {
        COLUMNS.to_vec()
    }

    fn step_s(&self) -> Option<f64> {
        Some(self.step_s)
    }

    fn expected(&self) -> Expected {
        Expected { gravity_m_s2: Some(self.gravity_m_s2), ..Expected::default() }
    }

    fn ground_m(&self) -> Option<f64> {
        Some(0.0)
    }

    fn step(&self, state: &[f64], _: &[f64], _: &[f64], next: &mut [f64]) {
        let mut s = BulletState { centre_m: state[0] + self.radius_m, velocity_m_s: state[1] };
        BulletBall::step(self, &mut s);
        (next[0], next[1]) = (s.centre_m - self.radius_m, s.velocity_m_s);
    }
}
