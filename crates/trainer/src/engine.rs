//! The analytical model as the nets use it: one step at a time.

use augsim_physics::ball::bullet::{BulletBall, BulletState};
use serde::{Deserialize, Serialize};

/// A physics engine with a fixed step: the f_p of the paper (section II).
pub trait Engine: Sync {
    /// Names of the state columns, with units.
    fn columns(&self) -> &'static [&'static str];

    /// State one step after `state`.
    fn step(&self, state: &[f64], next: &mut [f64]);

    /// States `[time, S]` of the roll-out from `start`, which is the first of them.
    fn rollout(&self, start: &[f64], time: usize) -> Vec<f64> {
        let s = start.len();
        let mut out = vec![0.0; time * s];
        for t in 0..time {
            let (done, rest) = out.split_at_mut(t * s);
            match t {
                0 => rest[..s].copy_from_slice(start),
                _ => self.step(&done[(t - 1) * s..], &mut rest[..s]),
            }
        }
        out
    }
}

/// Which engine a run uses, with its parameters; kept in the run's configuration and checkpoint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EngineSpec {
    /// PyBullet's stepping scheme for a ball on flat ground.
    PybulletBall(BulletBall),
}

impl Engine for EngineSpec {
    fn columns(&self) -> &'static [&'static str] {
        match self {
            EngineSpec::PybulletBall(_) => &["height_m", "velocity_m_s"],
        }
    }

    fn step(&self, state: &[f64], next: &mut [f64]) {
        match self {
            EngineSpec::PybulletBall(ball) => {
                let mut s = BulletState { centre_m: state[0] + ball.radius_m, velocity_m_s: state[1] };
                ball.step(&mut s);
                next[0] = s.centre_m - ball.radius_m;
                next[1] = s.velocity_m_s;
            }
        }
    }
}
