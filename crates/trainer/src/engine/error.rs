//! Reasons why a model file gives no engine.

use augsim_physics::model::ModelError;

/// A reason why a model cannot be simulated step by step.
#[derive(Debug, thiserror::Error)]
pub enum EngineError {
    /// The step is not positive or not finite.
    #[error("a step of {step_s} s must be a positive number")]
    Step {
        /// The step; NaN where none is given.
        step_s: f64,
    },
    /// An effect depends on a quantity that is not among the states.
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
    /// A model of pushing was given where one of a ball is needed.
    #[error("the model is one of pushing, but the run is one of throws; give the model of a ball")]
    NotThrown,
    /// The text is no model of equations, or one that cannot be compiled.
    #[error(transparent)]
    Written(#[from] Box<augsim_written::ModelError>),
    /// The text is no model file.
    #[error(transparent)]
    Model(#[from] Box<ModelError>),
}
