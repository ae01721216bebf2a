//! Mismatches between a saved run and the settings, data or task it is used with.

use crate::TrainerError;

/// The mismatch that makes a saved training state unusable for the given settings, data or task.
#[derive(Debug, thiserror::Error)]
pub enum Difference {
    /// The training data have different state columns than the saved run.
    #[error("its state columns differ from those of the data")]
    Columns,
    /// The training data have different values than those of the saved run.
    #[error("it was trained on other data")]
    Data,
    /// The state columns in the saved state differ from those of the saved engine.
    #[error("its state columns differ from those of its engine")]
    ColumnsOfEngine,
    /// The saved scales have sizes that do not match the saved settings.
    #[error("the sizes of its scales do not match its settings")]
    Scales,
    /// The number of saved parameters does not match the settings.
    #[error("its settings give a net of {expected} parameters, but it holds {found}")]
    Parameters {
        /// Number of parameters that a net with these settings has.
        expected: usize,
        /// Number of parameters in the saved state.
        found: usize,
    },
    /// The saved settings are out of range.
    #[error(transparent)]
    Settings(Box<TrainerError>),
    /// The columns of the data are not those of the engine.
    #[error("the engine has the {role} {}, but the data have {}", expected.join(", "), found.join(", "))]
    EngineColumns {
        /// Which columns differ: `states` or `actions`.
        role: &'static str,
        /// Names of the columns that the engine needs.
        expected: Vec<String>,
        /// Names of the columns that the data have.
        found: Vec<String>,
    },
    /// The initial state or the actions of a forecast task do not have the engine's columns.
    #[error("its forecasts need a start and actions with the columns {}, which the data lack", columns.join(", "))]
    Inputs {
        /// Columns that the engine needs: the state columns, then the action columns.
        columns: Vec<String>,
    },
    /// The saved run was stopped before training ended.
    #[error("its training has not ended, so the distribution of its latent is not fitted yet")]
    Unfinished,
    /// Reconstruction was requested of a net that corrects roll-outs or rates, or has no latent.
    #[error("nets for pushes or equations and nets without a latent can only forecast, not reconstruct")]
    NotReconstructable,
    /// Single steps were requested of a net that forecasts whole trajectories only.
    #[error(
        "only the recipes neural, hybrid, hybrid-standardised and hybrid-plus of a ball can be stepped; forecast whole trajectories with this one"
    )]
    NotSteppable,
    /// Filtering was requested of a net other than one with step corrections and one latent per trajectory.
    #[error(
        "filtered forecasts need a net that corrects single steps with one latent per trajectory (hybrid-plus of a ball)"
    )]
    NotFilterable,
    /// A state was given that does not have one value per state column.
    #[error("a state must have {expected} values, but {found} were given")]
    State {
        /// Number of state columns of the engine, and so of values in a state.
        expected: usize,
        /// Number of values in the given state.
        found: usize,
    },
    /// The engine is of another kind (ball, push, equations) than the saved run needs.
    #[error("its net or engine is for another kind of system")]
    OtherSystem,
}

impl From<Difference> for TrainerError {
    fn from(difference: Difference) -> Self {
        TrainerError::Mismatch { difference }
    }
}
