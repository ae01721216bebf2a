//! Why a model file gives no engine.

use augsim_physics::model::ModelError;

/// Why a model cannot be stepped.
#[derive(Debug, thiserror::Error)]
pub enum EngineError {
    /// The step makes no sense.
    #[error("a step of {step_s} s must be a positive number")]
    Step {
        /// The step; not a number where none is given.
        step_s: f64,
    },
    /// A law that the states do not decide.
    #[error(
        "effect `{kind}` depends on {what}, which the states of the data do not tell; take it out of the model file, or \
         find a model without it (`discover`)"
    )]
    Hidden {
        /// Kind of the effect.
        kind: String,
        /// The quantity that it depends on.
        what: &'static str,
    },
    /// A model of pushing where one of a ball is needed.
    #[error("the model is one of pushing, but the run is one of throws; give the model of a ball")]
    NotThrown,
    /// The text is no model of equations, or one that cannot be compiled.
    #[error(transparent)]
    Written(#[from] Box<augsim_written::ModelError>),
    /// The text is no model file.
    #[error(transparent)]
    Model(#[from] Box<ModelError>),
}
