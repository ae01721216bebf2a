//! The system of a model file as an engine, whether declared or extended by a discovery.

use super::ball::ModelBall;
use super::error::EngineError;
use super::motion::EngineModel;
use super::push::ModelPush;
use augsim_physics::ball::Axes;
use augsim_physics::model::ModelFile;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The system of a model file at the nominal values of its parameters.
/// Configurations and checkpoints hold the file's text. Deterministic effects of the motion are simulated.
/// Sensor effects are no part of the state, and random effects are left for the net to learn: both are
/// ignored.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "SerialisedEngine", into = "SerialisedEngine")]
pub struct SystemEngine {
    serialised: SerialisedEngine,
    motion: Arc<dyn EngineModel>,
}

/// The serialised form of a system engine in configurations and checkpoints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct SerialisedEngine {
    /// Time from one sample to the next, s; `None` where the actions include the time.
    step_s: Option<f64>,
    /// Text of the engine's model file.
    model: String,
}

impl SystemEngine {
    /// Creates the engine of a model file.
    /// `step_s` is the time between samples of the data in s, for systems whose actions do not include the time.
    ///
    /// # Errors
    /// [`EngineError`] if an effect depends on more than the states, or the step is not positive.
    pub fn new(file: &ModelFile, step_s: Option<f64>) -> Result<Self, EngineError> {
        let (model, motion): (String, Arc<dyn EngineModel>) = match file {
            ModelFile::Ball(model) => (
                model.to_toml(),
                Arc::new(ModelBall::new(model, Axes::Vertical, step_s.unwrap_or(f64::NAN))?),
            ),
            ModelFile::Push(model) => (model.to_toml(), Arc::new(ModelPush::new(model))),
        };
        Ok(SystemEngine { serialised: SerialisedEngine { step_s: motion.step_s(), model }, motion })
    }

    /// Text of the engine's model file.
    pub fn model(&self) -> &str {
        &self.serialised.model
    }

    pub(super) fn motion(&self) -> &dyn EngineModel {
        &*self.motion
    }
}

impl PartialEq for SystemEngine {
    fn eq(&self, other: &Self) -> bool {
        self.serialised == other.serialised
    }
}

impl TryFrom<SerialisedEngine> for SystemEngine {
    type Error = EngineError;
    fn try_from(serialised: SerialisedEngine) -> Result<Self, EngineError> {
        let file = ModelFile::parse(&serialised.model, "model of the run").map_err(Box::new)?;
        Self::new(&file, serialised.step_s)
    }
}

impl From<SystemEngine> for SerialisedEngine {
    fn from(engine: SystemEngine) -> Self {
        engine.serialised
    }
}
