//! Reasons why a model file gives no engine.

use augsim_physics::model::ModelError;

/// A reason why a model cannot be simulated step by step.
#[derive(Debug, thiserror::Error)]
pub enum EngineError {
    /// The time step is not positive or not finite.
    #[error("the time step is {step_s} s; it must be a positive finite number: check the times of the data")]
    Step {
        /// The rejected time step, s; NaN where none is given.
        step_s: f64,
    },
    /// An effect depends on a quantity that is not among the states.
    #[error(
        "effect `{kind}` depends on {what}, which is not among the states of the data; remove the effect from the \
         model file, or search for a model without it (`discover`)"
    )]
    Hidden {
        /// Name of the kind of the effect.
        kind: String,
        /// The quantity that the effect depends on.
        what: &'static str,
    },
    /// The model is one of pushing, but the engine needs one of a ball.
    #[error("the model file describes pushing, but the run needs a thrown ball: give the model of a ball")]
    NotThrown,
    /// The text is no model of equations, or the model cannot be compiled.
    #[error(transparent)]
    Equations(#[from] Box<augsim_equations::ModelError>),
    /// The text is no model file that can be read.
    #[error(transparent)]
    Model(#[from] Box<ModelError>),
}
