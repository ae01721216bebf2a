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
        /// What stands there.
        value: f32,
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
