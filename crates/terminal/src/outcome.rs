//! Outcome of a command and its exit code.

use crate::interrupt;
use std::process::ExitCode;

/// Outcome of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Done.
    Done,
    /// Done, but a criterion that the user requires is not met.
    CriterionNotMet,
    /// Interrupted by the user.
    Interrupted,
}

impl Outcome {
    /// Returns the exit code of the process.
    pub fn code(self) -> ExitCode {
        ExitCode::from(match self {
            Outcome::Done => 0,
            Outcome::CriterionNotMet => 1,
            Outcome::Interrupted => interrupt::exit_code(),
        })
    }
}
