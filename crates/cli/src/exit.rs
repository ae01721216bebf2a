//! Exit codes: 0 done, 1 done but the asked-for criterion is not met, 2 usage, 3 bad data, 4 numerical
//! failure, 130 interrupted (143 by SIGTERM, 129 by SIGHUP).

pub use crate::usage::Usage;

use crate::interrupt;
use crate::sweep::failed::TaskFailed;
use augsim_data::push::PushError;
use augsim_data::{DataError, Source, printable};
use augsim_discovery::DiscoveryError;
use augsim_trainer::TrainerError;
use std::io::Write;
use std::process::ExitCode;

/// How a command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Done.
    Done,
    /// Done, but a criterion that the user set is not met.
    CriterionNotMet,
    /// Stopped by the user, after a checkpoint.
    Interrupted,
}

impl Outcome {
    /// The process's exit code.
    pub fn code(self) -> ExitCode {
        ExitCode::from(match self {
            Outcome::Done => 0,
            Outcome::CriterionNotMet => 1,
            Outcome::Interrupted => interrupt::exit_code(),
        })
    }
}

/// Prints the error in one paragraph and gives its exit code.
pub fn report(error: &anyhow::Error) -> ExitCode {
    // Nothing can be done when standard error is closed.
    let _ = writeln!(std::io::stderr(), "augsim: error: {}", printable(&sentence(error)));
    ExitCode::from(code(error))
}

/// The error and its causes, each said once: many errors say their cause themselves.
fn sentence(error: &anyhow::Error) -> String {
    let mut told = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if !told.contains(&cause) {
            let colon = if told.is_empty() { "" } else { ": " };
            told = told + colon + &cause;
        }
    }
    told
}

fn code(error: &anyhow::Error) -> u8 {
    for cause in error.chain() {
        if cause.is::<Usage>() {
            return 2;
        }
        if let Some(failed) = cause.downcast_ref::<TaskFailed>() {
            return failed.code;
        }
        if let Some(e) = cause.downcast_ref::<DataError>()
            && asked_for(e)
        {
            return 2;
        }
        if cause.downcast_ref::<DiscoveryError>().is_some_and(DiscoveryError::is_numerical) {
            return 4;
        }
        if let Some(e) = cause.downcast_ref::<TrainerError>() {
            return match e {
                TrainerError::Setting { .. } => 2,
                TrainerError::Diverged { .. } | TrainerError::Tensor(_) => 4,
                _ => 3,
            };
        }
    }
    3
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

#[cfg(test)]
mod tests {
    //! Contract: an error is one sentence, which says each cause once.
    use super::*;
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
}
