//! The analytical model as the nets use it: one step at a time.

use crate::ball_model::ModelBall;
use crate::push::{self, PushEngine};
use augsim_data::checks::Expected;
use augsim_physics::ball::bullet::{BulletBall, BulletState};
use serde::{Deserialize, Serialize};

/// A physics engine with a fixed step: the f_p of the paper (section II).
pub trait Engine: Sync {
    /// Names of the state columns, with units.
    fn columns(&self) -> &'static [&'static str];

    /// Names of the action columns, with units; none where nobody acts.
    fn action_columns(&self) -> &'static [&'static str] {
        &[]
    }

    /// State one step after `state`, while the actions go from `from` to `to` (both empty without actions).
    fn step(&self, state: &[f64], from: &[f64], to: &[f64], next: &mut [f64]);

    /// States `[time, S]` of the roll-out from `start`, which is the first of them, under `actions [time, A]`.
    fn rollout(&self, start: &[f64], actions: &[f64], time: usize) -> Vec<f64> {
        step_by_step(self, start, actions, time)
    }
}

fn step_by_step(engine: &(impl Engine + ?Sized), start: &[f64], actions: &[f64], time: usize) -> Vec<f64> {
    let (s, a) = (start.len(), actions.len() / time);
    let action = |t: usize| &actions[t * a..(t + 1) * a];
    let mut out = vec![0.0; time * s];
    for t in 0..time {
        let (done, rest) = out.split_at_mut(t * s);
        match t {
            0 => rest[..s].copy_from_slice(start),
            _ => engine.step(&done[(t - 1) * s..], action(t - 1), action(t), &mut rest[..s]),
        }
    }
    out
}

/// Which engine a run uses, with its parameters; kept in the run's configuration and checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EngineSpec {
    /// PyBullet's stepping scheme for a ball on flat ground.
    PybulletBall(BulletBall),
    /// Pushing with one rod.
    Push(PushEngine),
    /// The ball of a model file.
    ModelBall(Box<ModelBall>),
}

impl EngineSpec {
    /// What the engine expects of the data that it is trained on: its gravity, where a ball falls.
    pub fn expected(&self) -> Expected {
        let gravity_m_s2 = match self {
            EngineSpec::PybulletBall(ball) => Some(ball.gravity_m_s2),
            EngineSpec::ModelBall(ball) => Some(ball.gravity_m_s2()),
            EngineSpec::Push(_) => None,
        };
        Expected { gravity_m_s2, ..Expected::default() }
    }

    /// Seconds from one state to the next, where the engine has a step of its own: that of the data must be the same.
    pub fn step_s(&self) -> Option<f64> {
        match self {
            EngineSpec::PybulletBall(ball) => Some(ball.step_s),
            EngineSpec::ModelBall(ball) => Some(ball.step_s()),
            EngineSpec::Push(_) => None,
        }
    }
}

impl Engine for EngineSpec {
    fn columns(&self) -> &'static [&'static str] {
        match self {
            EngineSpec::PybulletBall(_) | EngineSpec::ModelBall(_) => &["height_m", "velocity_m_s"],
            EngineSpec::Push(_) => &push::STATES,
        }
    }

    fn action_columns(&self) -> &'static [&'static str] {
        match self {
            EngineSpec::PybulletBall(_) | EngineSpec::ModelBall(_) => &[],
            EngineSpec::Push(_) => &push::ACTIONS,
        }
    }

    fn step(&self, state: &[f64], from: &[f64], to: &[f64], next: &mut [f64]) {
        match self {
            EngineSpec::PybulletBall(ball) => {
                let mut s = BulletState { centre_m: state[0] + ball.radius_m, velocity_m_s: state[1] };
                ball.step(&mut s);
                next[0] = s.centre_m - ball.radius_m;
                next[1] = s.velocity_m_s;
            }
            EngineSpec::Push(engine) => {
                let path = engine.poses(state, &[from, to].concat());
                next.copy_from_slice(&path[3..6]);
            }
            EngineSpec::ModelBall(ball) => ball.step(state, next),
        }
    }

    fn rollout(&self, start: &[f64], actions: &[f64], time: usize) -> Vec<f64> {
        match self {
            EngineSpec::PybulletBall(_) => step_by_step(self, start, actions, time),
            EngineSpec::Push(engine) => engine.poses(start, actions),
            EngineSpec::ModelBall(ball) => ball.rollout(start, time),
        }
    }
}
