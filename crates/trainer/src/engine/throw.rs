//! The ball of a model file, thrown in a plane or in space, as an engine.
//! Vertical motion and pushing are simulated by [`SystemEngine`](super::SystemEngine).

use super::ball::ModelBall;
use super::error::EngineError;
use augsim_physics::ball::Axes;
use augsim_physics::model::{Model, ModelFile};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The coordinates in which a throw was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ThrowAxes {
    /// Motion in a vertical plane, coordinates `x_m`, `z_m`.
    Plane,
    /// Motion in space, coordinates `x_m`, `y_m`, `z_m`.
    Space,
}

impl ThrowAxes {
    fn axes(self) -> Axes {
        match self {
            ThrowAxes::Plane => Axes::Plane,
            ThrowAxes::Space => Axes::Space,
        }
    }
}

/// A thrown ball at the nominal values of its model's parameters.
/// Configurations and checkpoints hold the text of the model file.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "SerialisedEngine", into = "SerialisedEngine")]
pub struct ThrowEngine {
    serialised: SerialisedEngine,
    motion: Arc<ModelBall>,
}

/// The serialised form of a throw engine in configurations and checkpoints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct SerialisedEngine {
    room: ThrowAxes,
    /// Time from one sample to the next, s.
    step_s: f64,
    /// Text of the engine's model file.
    model: String,
}

impl ThrowEngine {
    /// Creates the engine of the model of a thrown ball, which steps by `step_s` seconds.
    ///
    /// # Errors
    /// As [`SystemEngine::new`](super::SystemEngine::new).
    pub fn new(model: &Model, room: ThrowAxes, step_s: f64) -> Result<Self, EngineError> {
        let motion = Arc::new(ModelBall::new(model, room.axes(), step_s)?);
        Ok(ThrowEngine { serialised: SerialisedEngine { room, step_s, model: model.to_toml() }, motion })
    }

    /// The coordinates in which the throw was measured.
    pub fn room(&self) -> ThrowAxes {
        self.serialised.room
    }

    /// Text of the engine's model file.
    pub fn model(&self) -> &str {
        &self.serialised.model
    }

    pub(super) fn motion(&self) -> &ModelBall {
        &self.motion
    }
}

impl PartialEq for ThrowEngine {
    fn eq(&self, other: &Self) -> bool {
        self.serialised == other.serialised
    }
}

impl TryFrom<SerialisedEngine> for ThrowEngine {
    type Error = EngineError;
    fn try_from(serialised: SerialisedEngine) -> Result<Self, EngineError> {
        match ModelFile::parse(&serialised.model, "model of the run").map_err(Box::new)? {
            ModelFile::Ball(model) => Self::new(&model, serialised.room, serialised.step_s),
            ModelFile::Push(_) => Err(EngineError::NotThrown),
        }
    }
}

impl From<ThrowEngine> for SerialisedEngine {
    fn from(engine: ThrowEngine) -> Self {
        engine.serialised
    }
}
