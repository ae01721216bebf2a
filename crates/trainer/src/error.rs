//! Errors of the trainer crate.

use crate::difference::Difference;
use augsim_data::DataError;
use augsim_tensor::TensorError;

/// Refusals of training, prediction and evaluation.
#[derive(Debug, thiserror::Error)]
pub enum TrainerError {
    /// The data do not fit.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A tensor operation failed: a defect of the net's definition, or a value that is not finite.
    #[error(transparent)]
    Tensor(#[from] TensorError),
    /// There is nothing to train or evaluate on.
    #[error("{what} holds no trajectory; give at least one")]
    NoTrajectories {
        /// Which set.
        what: &'static str,
    },
    /// A trajectory is too short for a step to be predicted.
    #[error("trajectory `{id}` has {samples} sample(s); at least 2 are needed")]
    TooShort {
        /// The trajectory.
        id: String,
        /// Its samples.
        samples: usize,
    },
    /// A value is missing where the net needs one.
    #[error(
        "trajectory `{id}` has no value in column `{column}` at sample {sample}; nets need every sample measured"
    )]
    Gap {
        /// The trajectory.
        id: String,
        /// The column.
        column: String,
        /// Sample index, from 0.
        sample: usize,
    },
    /// A setting is out of range.
    #[error("setting `{key}` = {value}: {rule}")]
    Setting {
        /// Name of the setting.
        key: &'static str,
        /// Its value.
        value: String,
        /// Rule that the value breaks.
        rule: &'static str,
    },
    /// Training diverged.
    #[error(
        "iteration {iteration}: the loss is {loss}; lower the learning rate (now {rate:e}) or check the data"
    )]
    Diverged {
        /// Iteration, from 1.
        iteration: u64,
        /// Loss.
        loss: f64,
        /// Learning rate.
        rate: f64,
    },
    /// A forecast left the numbers.
    #[error(
        "trajectory `{id}`: the forecast is {value} from step {step} on; the net was not trained on such states: train longer \
         or on more of them, or take the trajectory out"
    )]
    NotFinite {
        /// The trajectory.
        id: String,
        /// First step that is no number, from 0.
        step: usize,
        /// The number that stands there.
        value: f32,
    },
    /// The rows seen of a trajectory leave its start open.
    #[error(
        "trajectory `{id}`: the {rows} row(s) seen do not say how it began: {needed} measured values are needed (fewer where the \
         sensor's noise is stated); see more rows or more columns"
    )]
    ShortPrefix {
        /// The trajectory.
        id: String,
        /// Rows seen.
        rows: usize,
        /// Measured values that are needed.
        needed: usize,
    },
    /// A value that should be seen is not there.
    #[error(
        "row {row} has no value in column {column} (both from 0), which the sensor sees; fill it in or see fewer rows"
    )]
    Unseen {
        /// Row, from 0.
        row: usize,
        /// State column, from 0.
        column: usize,
    },
    /// A row of another width, or one more than the actions reach.
    #[error("row {row}: a row has {expected} values and is one of {rows}; this one has {found}")]
    Row {
        /// Row, from 0.
        row: usize,
        /// State columns.
        expected: usize,
        /// Values found.
        found: usize,
        /// Rows that the actions reach.
        rows: usize,
    },
    /// A trajectory cannot be simulated at any values that fit its beginning.
    #[error("trajectory `{id}` cannot be simulated beyond the rows seen; check the model's parameters")]
    NotSimulated {
        /// The trajectory.
        id: String,
    },
    /// A saved training state does not belong to these settings or data.
    #[error(
        "the checkpoint does not belong to this run: {difference}; use the run's own data and settings, or start a new run"
    )]
    Foreign {
        /// The part that differs.
        difference: Difference,
    },
}
