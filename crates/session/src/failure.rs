//! Kinds of errors: exit codes and Python's exceptions follow from it.

use crate::Usage;
use augsim_data::push::PushError;
use augsim_data::{DataError, Source};
use augsim_discovery::DiscoveryError;
use augsim_trainer::{EngineError, TrainerError};

/// The kind of a failure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// The request makes no sense, or not together with the files on disk.
    Usage,
    /// A model file is wrong.
    Model,
    /// Data are wrong, or do not go with the model.
    Data,
    /// Numbers overflowed, or a fit or a training diverged.
    Numerical,
}

impl Failure {
    /// The kind of an error, by the first of its causes that says one.
    pub fn of(error: &anyhow::Error) -> Self {
        error.chain().find_map(Self::of_cause).unwrap_or(Failure::Data)
    }

    fn of_cause(cause: &(dyn std::error::Error + 'static)) -> Option<Self> {
        if cause.is::<Usage>() {
            return Some(Failure::Usage);
        }
        if cause.is::<augsim_physics::model::ModelError>()
            || cause.is::<augsim_written::ModelError>()
            || cause.is::<EngineError>()
        {
            return Some(Failure::Model);
        }
        if let Some(e) = cause.downcast_ref::<DataError>() {
            return asked_for(e).then_some(Failure::Usage);
        }
        if cause.downcast_ref::<DiscoveryError>().is_some_and(DiscoveryError::is_numerical) {
            return Some(Failure::Numerical);
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

/// Whether data are refused for what an option asked for, not for what a file holds: a set in memory is as large as the
/// options make it.
fn asked_for(error: &DataError) -> bool {
    matches!(
        error,
        DataError::Limit { origin: Source::Memory, .. }
            | DataError::Push(PushError::Rate { .. } | PushError::RateTooHigh { .. })
    )
}

/// The error and its causes, each said once: many errors say their cause themselves.
pub fn sentence(error: &anyhow::Error) -> String {
    let mut told = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if !told.contains(&cause) {
            let colon = if told.is_empty() { "" } else { ": " };
            told = told + colon + &cause;
        }
    }
    told
}

#[cfg(test)]
mod tests {
    //! Contract: an error is one sentence, which says each cause once, and the first cause that has a kind decides.
    use super::*;
    use crate::usage::Missing;
    use anyhow::Context;

    #[test]
    fn a_cause_is_not_said_twice() {
        let full = || std::io::Error::from(std::io::ErrorKind::StorageFull);
        let own =
            augsim_nn::checkpoint::CheckpointError::Io { path: "run/checkpoint.bin".into(), source: full() };
        let cause = full();
        let error = Err::<(), _>(own).context("scoring").unwrap_err();
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
        assert_eq!(Failure::of(&anyhow::Error::from(model).context("reading")), Failure::Model);
        assert_eq!(Failure::of(&Usage::Missing(Missing::Configuration).into()), Failure::Usage);
        let diverged = TrainerError::Diverged { iteration: 1, loss: f64::NAN, rate: 1.0 };
        assert_eq!(Failure::of(&diverged.into()), Failure::Numerical);
        assert_eq!(Failure::of(&anyhow::anyhow!("whatever")), Failure::Data);
    }
}
