//! Differences between a saved run and what it is asked to do.

use crate::TrainerError;

/// The part in which a saved state does not belong to settings, data or a task.
#[derive(Debug, thiserror::Error)]
pub enum Difference {
    /// The training data have other state columns.
    #[error("its state columns are others")]
    Columns,
    /// The training data have other values.
    #[error("it was trained on other data")]
    Data,
    /// The saved state columns are not those of the saved engine.
    #[error("its state columns are not those of its engine")]
    ColumnsOfEngine,
    /// The saved scales have the sizes of other settings.
    #[error("its scales are those of other settings")]
    Scales,
    /// The saved parameters are not as many as the settings make.
    #[error("its settings make {expected} parameters, but it holds {found}")]
    Parameters {
        /// Parameters of a net with these settings.
        expected: usize,
        /// Parameters that are saved.
        found: usize,
    },
    /// The saved settings are out of range.
    #[error(transparent)]
    Settings(Box<TrainerError>),
    /// The data have other columns than the engine.
    #[error("the engine's {role} are {}, the data's are {}", expected.join(", "), found.join(", "))]
    EngineColumns {
        /// `states` or `actions`.
        role: &'static str,
        /// Columns of the engine.
        expected: Vec<String>,
        /// Columns of the data.
        found: Vec<String>,
    },
    /// The task lacks columns that the forecast begins from.
    #[error("it forecasts from {} of every sample, which the data lack", columns.join(", "))]
    Inputs {
        /// Columns of states and actions.
        columns: Vec<String>,
    },
    /// The run was stopped before its end.
    #[error("its training has not ended, so the law of its latent is not fitted yet")]
    Unfinished,
    /// A net that corrects roll-outs, or has no latent, has no reconstruction.
    #[error("nets of pushes and nets without a latent only forecast")]
    OnlyForecasts,
    /// A net that reads the whole path of an action, or is no net of ours or the paper's, has no single steps.
    #[error(
        "only nets of balls that are hybrid or neural go step by step; sample this one over whole trajectories"
    )]
    OnlyRollouts,
    /// Only a net with one latent a trajectory and corrections of single steps can be filtered.
    #[error(
        "only a net that corrects single steps with one latent a trajectory (hybrid-plus of a ball) can be filtered"
    )]
    NotFiltered,
    /// A state has not one value for each column.
    #[error("a state has {expected} values, not {found}")]
    State {
        /// State columns of the engine.
        expected: usize,
        /// Values that were given.
        found: usize,
    },
    /// The new engine has other columns than the run's.
    #[error("it moves another kind of system")]
    OtherSystem,
}

impl From<Difference> for TrainerError {
    fn from(difference: Difference) -> Self {
        TrainerError::Foreign { difference }
    }
}
