//! Kinds of failure, from which exit codes and Python exceptions follow.

use crate::Usage;
use crate::equations::fit::OutOfTime;
use crate::robot::RobotFault;
use augsim_data::push::PushError;
use augsim_data::{DataError, Source};
use augsim_design::DesignError;
use augsim_discovery::DiscoveryError;
use augsim_robot::TreeError;
use augsim_trainer::{EngineError, TrainerError};

/// The kind of a failure, which decides the exit code and the Python exception.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// The request is invalid, or contradicts the files on disk.
    Usage,
    /// A model file is invalid.
    Model,
    /// Data are invalid, or do not fit the model.
    Data,
    /// Numbers overflowed, a fit or a training diverged, or the time limit passed before there was a result.
    Numerical,
}

impl Failure {
    /// Determines the kind of an error: that of the first error in its chain that has one, else [`Failure::Data`].
    pub fn classify(error: &anyhow::Error) -> Self {
        error.chain().find_map(Self::kind_of_cause).unwrap_or(Failure::Data)
    }

    fn kind_of_cause(cause: &(dyn std::error::Error + 'static)) -> Option<Self> {
        if cause.is::<Usage>() {
            return Some(Failure::Usage);
        }
        if cause.is::<augsim_physics::model::ModelError>()
            || cause.is::<augsim_equations::ModelError>()
            || cause.is::<EngineError>()
            || cause.is::<augsim_robot::DescriptionError>()
        {
            return Some(Failure::Model);
        }
        if let Some(e) = cause.downcast_ref::<RobotFault>() {
            return Some(match e {
                RobotFault::UnknownJoint { .. } | RobotFault::Expression(_) => Failure::Usage,
                // Joints that the user named; those found in the log can move.
                RobotFault::Tree(
                    TreeError::UnknownJoint { .. }
                    | TreeError::NamedTwice { .. }
                    | TreeError::Fixed { .. }
                    | TreeError::Coupled { .. },
                ) => Failure::Usage,
                RobotFault::Tree(_) => Failure::Model,
                _ => Failure::Data,
            });
        }
        if let Some(e) = cause.downcast_ref::<DataError>() {
            return is_caused_by_option(e).then_some(Failure::Usage);
        }
        if cause.is::<OutOfTime>()
            || cause.downcast_ref::<DiscoveryError>().is_some_and(DiscoveryError::is_numerical)
        {
            return Some(Failure::Numerical);
        }
        if let Some(e) = cause.downcast_ref::<DesignError>() {
            return Some(match e {
                DesignError::NoDesign(_) => Failure::Usage,
                DesignError::Objection { .. } => Failure::Data,
                DesignError::Simulation { .. } | DesignError::NotFinite { .. } => Failure::Numerical,
            });
        }
        cause.downcast_ref::<TrainerError>().map(|e| match e {
            TrainerError::Setting { .. } => Failure::Usage,
            TrainerError::Diverged { .. } | TrainerError::NotFinite { .. } | TrainerError::Tensor(_) => {
                Failure::Numerical
            }
            _ => Failure::Data,
        })
    }
}

/// Whether a data error is caused by an option, not by the content of a file.
///
/// The size of generated data follows from the options.
fn is_caused_by_option(error: &DataError) -> bool {
    matches!(
        error,
        DataError::Limit { origin: Source::Memory, .. }
            | DataError::Push(PushError::Rate { .. } | PushError::RateTooHigh { .. })
    )
}

/// Joins the messages of an error and its causes, skipping any that an earlier message already contains.
pub fn sentence(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if !text.contains(&cause) {
            let colon = if text.is_empty() { "" } else { ": " };
            text = text + colon + &cause;
        }
    }
    text
}

#[cfg(test)]
mod tests {
    //! Contract: an error becomes one sentence that states each cause once; the first cause with a kind
    //! decides the kind.
    use super::*;
    use crate::usage::Missing;
    use anyhow::Context;

    #[test]
    fn a_cause_is_not_stated_twice() {
        let full = || std::io::Error::from(std::io::ErrorKind::StorageFull);
        let checkpoint_error =
            augsim_nn::checkpoint::CheckpointError::Io { path: "run/checkpoint.bin".into(), source: full() };
        let cause = full();
        let error = Err::<(), _>(checkpoint_error).context("scoring").unwrap_err();
        assert_eq!(
            sentence(&error),
            format!("scoring: run/checkpoint.bin: cannot read the checkpoint: {cause}")
        );
        let error = Err::<(), _>(full()).context("standard output").unwrap_err();
        assert_eq!(sentence(&error), format!("standard output: {cause}"));
    }

    #[test]
    fn the_kind_is_that_of_the_cause() {
        let model = augsim_physics::model::ModelFile::parse("scenario = 1", "m.toml").unwrap_err();
        assert_eq!(Failure::classify(&anyhow::Error::from(model).context("reading")), Failure::Model);
        assert_eq!(Failure::classify(&Usage::Missing(Missing::Configuration).into()), Failure::Usage);
        let diverged = TrainerError::Diverged { iteration: 1, loss: f64::NAN, rate: 1.0 };
        assert_eq!(Failure::classify(&diverged.into()), Failure::Numerical);
        assert_eq!(Failure::classify(&anyhow::anyhow!("whatever")), Failure::Data);
    }
}
