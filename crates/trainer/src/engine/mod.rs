//! The analytical model as the nets use it: one step at a time, or rolled out from the first state.

mod ball;
mod bullet;
mod error;
mod motion;
mod push;
mod system;
mod throw;
mod written;

pub use error::EngineError;
pub(crate) use push::ModelPush;
pub use system::SystemEngine;
pub use throw::{Room, ThrowEngine};
pub use written::WrittenEngine;
pub(crate) use written::WrittenMotion;

use augsim_data::checks::Expected;
use augsim_physics::ball::bullet::BulletBall;
use augsim_physics::model::ModelFile;
use motion::Motion;
use serde::{Deserialize, Serialize};
use std::any::Any;

/// A physics engine: the f_p of the paper (section II). Kept in the run's configuration and checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Engine {
    /// PyBullet's stepping scheme for a ball on flat ground.
    PybulletBall(BulletBall),
    /// The system of a model file.
    Model(SystemEngine),
    /// The ball of a model file, thrown in the plane or in space.
    Throw(ThrowEngine),
    /// A system of equations.
    Written(WrittenEngine),
}

impl Engine {
    /// The engine of a model file; `step_s` as [`SystemEngine::new`] takes it.
    ///
    /// # Errors
    /// The errors of [`SystemEngine::new`].
    pub fn of(file: &ModelFile, step_s: Option<f64>) -> Result<Self, EngineError> {
        SystemEngine::new(file, step_s).map(Engine::Model)
    }

    fn motion(&self) -> &dyn Motion {
        match self {
            Engine::PybulletBall(ball) => ball,
            Engine::Model(system) => system.motion(),
            Engine::Throw(throw) => throw.motion(),
            Engine::Written(system) => system.motion(),
        }
    }

    /// The engine of another model file for the same data.
    ///
    /// # Errors
    /// As [`SystemEngine::new`].
    pub fn with_model(&self, file: &ModelFile) -> Result<Self, EngineError> {
        match (self, file) {
            (Engine::Throw(throw), ModelFile::Ball(model)) => {
                let step_s = self.step_s().unwrap_or(f64::NAN);
                ThrowEngine::new(model, throw.room(), step_s).map(Engine::Throw)
            }
            _ => Engine::of(file, self.step_s()),
        }
    }

    /// The model file behind it; none where there is none.
    pub fn model(&self) -> Option<&str> {
        match self {
            Engine::PybulletBall(_) => None,
            Engine::Model(system) => Some(system.model()),
            Engine::Throw(throw) => Some(throw.model()),
            Engine::Written(system) => Some(system.model()),
        }
    }

    /// Kinds of the model's effects that take no part: what the sensor adds, and what is random.
    pub fn left_out(&self) -> &[String] {
        self.motion().left_out()
    }

    /// Seconds that contacts last which single steps take for an instant, where there are any.
    pub fn contact_s(&self) -> Option<f64> {
        self.motion().contact_s()
    }

    /// Names of the state columns, with units.
    pub fn columns(&self) -> Vec<&str> {
        self.motion().columns()
    }

    /// Names of the action columns, with units; none where nobody acts.
    pub fn action_columns(&self) -> Vec<&str> {
        self.motion().action_columns()
    }

    /// Statements of the engine about the data that it is trained on: its gravity, where a ball falls.
    pub fn expected(&self) -> Expected {
        self.motion().expected()
    }

    /// Seconds from one state to the next, where the engine has a step of its own: that of the data must be the same.
    pub fn step_s(&self) -> Option<f64> {
        self.motion().step_s()
    }

    /// Height of the flat ground in the data, m, under what moves only up and down.
    pub(crate) fn ground_m(&self) -> Option<f64> {
        self.motion().ground_m()
    }

    /// State one step after `state`, while the actions go from `from` to `to` (both empty without actions).
    pub fn step(&self, state: &[f64], from: &[f64], to: &[f64], next: &mut [f64]) {
        self.motion().step(state, from, to, next);
    }

    /// Number P of the parameters that [`own_changes`](Self::own_changes) knows.
    pub(crate) fn own_parameters(&self) -> usize {
        self.motion().own_parameters()
    }

    /// Changes `[P, S]` of the state that [`step`](Self::step) gives, to first order, where a parameter that is likely to be a
    /// trajectory's own moves by its likely spread.
    pub(crate) fn own_changes(&self, state: &[f64], from: &[f64], to: &[f64], changes: &mut [f64]) {
        self.motion().own_changes(state, from, to, changes);
    }

    /// States `[time, S]` of the roll-out from `start`, which is the first of them, under `actions [time, A]`.
    pub fn rollout(&self, start: &[f64], actions: &[f64], time: usize) -> Vec<f64> {
        self.motion().rollout(start, actions, time)
    }

    /// The equations, where a model file writes them out: their rates are what is corrected.
    pub fn written(&self) -> Option<&WrittenEngine> {
        match self {
            Engine::Written(system) => Some(system),
            _ => None,
        }
    }

    /// The motion by equations whose rates are corrected.
    pub(crate) fn rates(&self) -> Option<&WrittenMotion> {
        self.written().map(WrittenEngine::motion)
    }

    /// The pushing, where a rod pushes an object: contacts are what features of its path are made of.
    pub(crate) fn pushing(&self) -> Option<&ModelPush> {
        (self.motion() as &dyn Any).downcast_ref()
    }
}
