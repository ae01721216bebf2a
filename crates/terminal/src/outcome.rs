//! How a command ends.

use crate::interrupt;
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
