//! PyBullet's time-stepping scheme for a ball, as an engine whose steps nets correct.

use super::ball::{COLUMNS, RESTITUTION_SPREAD};
use super::motion::EngineModel;
use augsim_data::checks::ExpectedData;
use augsim_physics::ball::bullet::{BulletBall, BulletState};

impl EngineModel for BulletBall {
    fn columns(&self) -> Vec<&str> {
        COLUMNS.to_vec()
    }

    fn step_s(&self) -> Option<f64> {
        Some(self.step_s)
    }

    fn expected(&self) -> ExpectedData {
        ExpectedData { gravity_m_s2: Some(self.gravity_m_s2), ..ExpectedData::default() }
    }

    fn ground_m(&self) -> Option<f64> {
        Some(0.0)
    }

    fn step(&self, state: &[f64], _: &[f64], _: &[f64], next: &mut [f64]) {
        let mut s = BulletState { centre_m: state[0] + self.radius_m, velocity_m_s: state[1] };
        BulletBall::step(self, &mut s);
        (next[0], next[1]) = (s.centre_m - self.radius_m, s.velocity_m_s);
    }

    fn sensitivity_count(&self) -> usize {
        1
    }

    fn trajectory_sensitivities(&self, state: &[f64], _: &[f64], _: &[f64], changes: &mut [f64]) {
        // A step is linear in the restitution between 0 and 1.
        let [bounced, stopped] = [1.0, 0.0].map(|restitution| {
            let mut s = BulletState { centre_m: state[0] + self.radius_m, velocity_m_s: state[1] };
            self.step_with(restitution, &mut s);
            s
        });
        changes[0] = RESTITUTION_SPREAD * (bounced.centre_m - stopped.centre_m);
        changes[1] = RESTITUTION_SPREAD * (bounced.velocity_m_s - stopped.velocity_m_s);
    }
}
