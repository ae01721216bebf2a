//! Physics engines that nets correct: single steps, and roll-outs from an initial state.

mod ball;
mod bullet;
mod equations;
mod error;
mod motion;
mod push;
mod system;
mod throw;

pub use equations::EquationEngine;
pub(crate) use equations::EquationMotion;
pub use error::EngineError;
pub(crate) use push::ModelPush;
pub use system::SystemEngine;
pub use throw::{ThrowAxes, ThrowEngine};

use augsim_data::checks::ExpectedData;
use augsim_physics::ball::bullet::BulletBall;
use augsim_physics::model::ModelFile;
use motion::EngineModel;
use serde::{Deserialize, Serialize};
use std::any::Any;

/// A physics engine, which advances states by one step: f_p of the paper (section II).
/// It is part of a run's configuration and checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Engine {
    /// PyBullet's stepping scheme for a ball on flat ground.
    PybulletBall(BulletBall),
    /// The system of a model file, with vertical motion of a ball or pushing.
    Model(SystemEngine),
    /// The ball of a model file, thrown in a plane or in space.
    Throw(ThrowEngine),
    /// A system of equations, from a model file.
    #[serde(rename = "written")]
    Equations(EquationEngine),
}

impl Engine {
    /// Creates the engine of a model file; `step_s` is the time step as for [`SystemEngine::new`].
    ///
    /// # Errors
    /// The errors of [`SystemEngine::new`].
    pub fn from_model_file(file: &ModelFile, step_s: Option<f64>) -> Result<Self, EngineError> {
        SystemEngine::new(file, step_s).map(Engine::Model)
    }

    fn motion(&self) -> &dyn EngineModel {
        match self {
            Engine::PybulletBall(ball) => ball,
            Engine::Model(system) => system.motion(),
            Engine::Throw(throw) => throw.motion(),
            Engine::Equations(system) => system.motion(),
        }
    }

    /// Creates the engine of another model file for the same data.
    ///
    /// # Errors
    /// The errors of [`SystemEngine::new`].
    pub fn with_model(&self, file: &ModelFile) -> Result<Self, EngineError> {
        match (self, file) {
            (Engine::Throw(throw), ModelFile::Ball(model)) => {
                let step_s = self.step_s().unwrap_or(f64::NAN);
                ThrowEngine::new(model, throw.room(), step_s).map(Engine::Throw)
            }
            _ => Engine::from_model_file(file, self.step_s()),
        }
    }

    /// Text of the model file; `None` if the engine has none.
    pub fn model(&self) -> Option<&str> {
        match self {
            Engine::PybulletBall(_) => None,
            Engine::Model(system) => Some(system.model()),
            Engine::Throw(throw) => Some(throw.model()),
            Engine::Equations(system) => Some(system.model()),
        }
    }

    /// Kinds of the model's effects that this engine ignores: sensor effects and random effects.
    pub fn ignored_effects(&self) -> &[String] {
        self.motion().ignored_effects()
    }

    /// Duration of contacts that single steps treat as instantaneous, s; `None` if the model has no such effect.
    pub fn contact_duration_s(&self) -> Option<f64> {
        self.motion().contact_duration_s()
    }

    /// Names of the state columns, with units.
    pub fn columns(&self) -> Vec<&str> {
        self.motion().columns()
    }

    /// Names of the action columns, with units; empty without actions.
    pub fn action_columns(&self) -> Vec<&str> {
        self.motion().action_columns()
    }

    /// Properties that the training data should show, such as the gravity of a falling ball.
    pub fn expected(&self) -> ExpectedData {
        self.motion().expected()
    }

    /// Time step, s, which the data must have too; `None` if the step varies with the samples.
    pub fn step_s(&self) -> Option<f64> {
        self.motion().step_s()
    }

    /// Height of flat ground in the data, m; `None` for systems that do not only move vertically.
    pub(crate) fn ground_m(&self) -> Option<f64> {
        self.motion().ground_m()
    }

    /// Writes the state one step after `state` to `next`, while the actions go from `from` to `to`.
    /// Both actions are empty for systems without actions.
    pub fn step(&self, state: &[f64], from: &[f64], to: &[f64], next: &mut [f64]) {
        self.motion().step(state, from, to, next);
    }

    /// Number P of trajectory-specific parameters in [`trajectory_sensitivities`](Self::trajectory_sensitivities).
    pub(crate) fn sensitivity_count(&self) -> usize {
        self.motion().sensitivity_count()
    }

    /// Computes how per-trajectory parameters change the state after a [`step`](Self::step), `[P, S]`.
    /// First order, for a change of each parameter by its typical spread between trajectories.
    pub(crate) fn trajectory_sensitivities(
        &self,
        state: &[f64],
        from: &[f64],
        to: &[f64],
        changes: &mut [f64],
    ) {
        self.motion().trajectory_sensitivities(state, from, to, changes);
    }

    /// Simulates states `[time, S]` under `actions [time, A]`; the first state is `start`.
    pub fn rollout(&self, start: &[f64], actions: &[f64], time: usize) -> Vec<f64> {
        self.motion().rollout(start, actions, time)
    }

    /// The equation engine; `None` if the model file has no equations.
    pub fn equation_engine(&self) -> Option<&EquationEngine> {
        match self {
            Engine::Equations(system) => Some(system),
            _ => None,
        }
    }

    /// The equation model whose rates are corrected; `None` if the engine has none.
    pub(crate) fn rate_model(&self) -> Option<&EquationMotion> {
        self.equation_engine().map(EquationEngine::motion)
    }

    /// The engine of a rod that pushes an object, from whose contacts features are computed; else `None`.
    pub(crate) fn push_model(&self) -> Option<&ModelPush> {
        (self.motion() as &dyn Any).downcast_ref()
    }
}
