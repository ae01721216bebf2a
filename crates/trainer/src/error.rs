//! Errors of the trainer crate.

use crate::difference::Difference;
use augsim_data::DataError;
use augsim_tensor::TensorError;

/// Errors of training, prediction and evaluation.
#[derive(Debug, thiserror::Error)]
pub enum TrainerError {
    /// The data set lacks a column or cannot be read.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A tensor operation failed: shapes in the net's definition do not match, or a value is not finite.
    #[error(transparent)]
    Tensor(#[from] TensorError),
    /// A set of trajectories (such as the training or the test set) is empty.
    #[error("{what} contains no trajectory; give at least one")]
    NoTrajectories {
        /// Which set is empty, such as `the data set`.
        what: &'static str,
    },
    /// A trajectory has fewer than the two samples that one prediction step needs.
    #[error("trajectory `{id}` has {samples} sample(s); at least 2 are needed")]
    TooShort {
        /// Identifier of the trajectory that is too short.
        id: String,
        /// Number of samples of the trajectory.
        samples: usize,
    },
    /// A state or action value is missing.
    #[error(
        "trajectory `{id}` has no value in column `{column}` at sample {sample}; nets need a value at every sample: \
         fill the gap in, or leave the trajectory out"
    )]
    Gap {
        /// Identifier of the trajectory with the missing value.
        id: String,
        /// Name of the column with the missing value.
        column: String,
        /// Index of the sample with the missing value, from 0.
        sample: usize,
    },
    /// A setting is out of range.
    #[error("setting `{key}` = {value}: {rule}")]
    Setting {
        /// Name of the setting that is out of range.
        key: &'static str,
        /// Value of the setting, as text.
        value: String,
        /// Rule that the value breaks, as the end of the sentence `setting ...: <rule>`.
        rule: &'static str,
    },
    /// Training diverged: the loss or the gradient is not finite.
    #[error(
        "iteration {iteration}: the loss is {loss}; lower the learning rate (now {rate:e}) or check the data"
    )]
    Diverged {
        /// Iteration at which training diverged, from 1.
        iteration: u64,
        /// Loss of the iteration at which training diverged.
        loss: f64,
        /// Learning rate of the iteration at which training diverged.
        rate: f64,
    },
    /// A forecast diverged: a value is not finite.
    #[error(
        "trajectory `{id}`: the forecast diverged at step {step} (value {value}), probably because the net was not trained \
         on such states; train longer, add similar trajectories to the training set, or leave this one out"
    )]
    NotFinite {
        /// Identifier of the trajectory whose forecast diverged.
        id: String,
        /// First step with a value that is not finite, from 0.
        step: usize,
        /// Value of the forecast at that step (NaN or infinite).
        value: f32,
    },
    /// The observed rows of a trajectory do not determine its initial state.
    #[error(
        "trajectory `{id}`: the {rows} observed row(s) do not determine the initial state, which takes {needed} measured \
         values (fewer if the sensor noise is given); observe more rows or more columns"
    )]
    UndeterminedStart {
        /// Identifier of the trajectory whose initial state is not determined.
        id: String,
        /// Number of observed rows (samples) of the trajectory.
        rows: usize,
        /// Number of measured values that are needed to determine the initial state.
        needed: usize,
    },
    /// A value that the sensor should have measured is missing.
    #[error(
        "row {row} has no value in column {column} (both counted from 0), which the sensor measures; fill it in, or observe \
         fewer rows"
    )]
    MissingMeasurement {
        /// Index of the row (sample) with the missing value, from 0.
        row: usize,
        /// Index of the state column with the missing value, from 0.
        column: usize,
    },
    /// A row of observations has the wrong number of values, or lies beyond the last row that has actions.
    #[error("row {row} has {found} values; each of the {rows} rows must have {expected} values")]
    Row {
        /// Index of the rejected row of observations, from 0.
        row: usize,
        /// Number of state columns, which a row must have as values.
        expected: usize,
        /// Number of values that the row has.
        found: usize,
        /// Number of rows of the trajectory that have actions.
        rows: usize,
    },
    /// No parameter values that fit the observed rows give a finite simulation beyond them.
    #[error("trajectory `{id}` cannot be simulated beyond the observed rows; check the model's parameters")]
    NotSimulated {
        /// Identifier of the trajectory that cannot be simulated.
        id: String,
    },
    /// A saved training state does not match these settings, data or task.
    #[error(
        "the checkpoint does not belong to this run: {difference}; use the data and settings of the saved run, or start a new run"
    )]
    Mismatch {
        /// The part of settings, data or task that does not match the saved state.
        difference: Difference,
    },
}
