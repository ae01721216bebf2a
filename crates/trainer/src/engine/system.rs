//! The system of a model file as an engine: what the nets correct, be it declared or augmented by a discovery.

use super::ball::ModelBall;
use super::error::EngineError;
use super::motion::Motion;
use super::push::ModelPush;
use augsim_physics::ball::Axes;
use augsim_physics::model::ModelFile;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The system of a model file at the nominal values of its parameters; configurations and checkpoints hold the file's text.
///
/// Laws of the motion act. What the sensor adds is no part of the state, and what is random is for the net to learn: both
/// are left out.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Declared", into = "Declared")]
pub struct SystemEngine {
    declared: Declared,
    motion: Arc<dyn Motion>,
}

/// The form of an engine in configurations and checkpoints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Declared {
    /// Seconds from one sample to the next; absent where the actions have a clock.
    step_s: Option<f64>,
    /// Text of the model file.
    model: String,
}

impl SystemEngine {
    /// The engine of a model file. `step_s` are the seconds between the samples of the data, for systems whose actions have
    /// no clock.
    ///
    /// # Errors
    /// [`EngineError`], where a law depends on more than the states, or the step is not positive.
    pub fn new(file: &ModelFile, step_s: Option<f64>) -> Result<Self, EngineError> {
        let (model, motion): (String, Arc<dyn Motion>) = match file {
            ModelFile::Ball(model) => (
                model.to_toml(),
                Arc::new(ModelBall::new(model, Axes::Vertical, step_s.unwrap_or(f64::NAN))?),
            ),
            ModelFile::Push(model) => (model.to_toml(), Arc::new(ModelPush::new(model))),
        };
        Ok(SystemEngine { declared: Declared { step_s: motion.step_s(), model }, motion })
    }

    /// Text of the model file.
    pub fn model(&self) -> &str {
        &self.declared.model
    }

    pub(super) fn motion(&self) -> &dyn Motion {
        &*self.motion
    }
}

impl PartialEq for SystemEngine {
    fn eq(&self, other: &Self) -> bool {
        self.declared == other.declared
    }
}

impl TryFrom<Declared> for SystemEngine {
    type Error = EngineError;
    fn try_from(declared: Declared) -> Result<Self, EngineError> {
        let file = ModelFile::parse(&declared.model, "model of the run").map_err(Box::new)?;
        Self::new(&file, declared.step_s)
    }
}

impl From<SystemEngine> for Declared {
    fn from(engine: SystemEngine) -> Self {
        engine.declared
    }
}
