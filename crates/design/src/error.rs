//! Errors of experiment design and of the evidence of recordings.

use augsim_system::{Objection, SimulationError};
use thiserror::Error;

/// Reasons why an experiment cannot be designed or a recording not be judged.
#[derive(Debug, Error)]
pub enum DesignError {
    /// An explanation cannot be simulated.
    #[error("{name}: {cause}")]
    Simulation {
        /// Name of the explanation.
        name: String,
        /// Error of the simulation.
        cause: SimulationError,
    },
    /// An explanation refuses a recording.
    #[error("{name}: {cause}")]
    Objection {
        /// Name of the explanation.
        name: String,
        /// Reason of the explanation's system.
        cause: Objection,
    },
    /// The predictions of an explanation are not finite.
    #[error(
        "{name}: the likelihood of recording `{record}` is not finite; check its values and the model's noise"
    )]
    NotFinite {
        /// Name of the explanation.
        name: String,
        /// Name of the recording.
        record: String,
    },
    /// No input within the limits keeps all explanations within them.
    #[error("{0}")]
    NoDesign(String),
}
