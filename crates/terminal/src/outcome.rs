//! Outcome of a command and its exit code.

use crate::interrupt;
use std::process::ExitCode;

/// Outcome of a command, which determines its exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The command is done.
    Done,
    /// The command is done, but a criterion that the user requires is not met.
    CriterionNotMet,
    /// The user interrupted the command.
    Interrupted,
}

impl Outcome {
    /// Returns the exit code of the process for this outcome.
    pub fn code(self) -> ExitCode {
        ExitCode::from(match self {
            Outcome::Done => 0,
            Outcome::CriterionNotMet => 1,
            Outcome::Interrupted => interrupt::exit_code(),
        })
    }
}
