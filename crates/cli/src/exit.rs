//! Exit codes: 0 done, 1 done but the asked-for criterion is not met, 2 usage, 3 bad data, 4 numerical
//! failure, 130 interrupted.

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
            Outcome::Interrupted => 130,
        })
    }
}

/// The command line makes no sense together with what is on disk.
#[derive(Debug)]
pub struct Usage(pub String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// Prints the error in one paragraph and gives its exit code.
pub fn report(error: &anyhow::Error) -> ExitCode {
    // Nothing can be done when standard error is closed.
    let _ = writeln!(std::io::stderr(), "augsim: error: {error:#}");
    ExitCode::from(code(error))
}

fn code(error: &anyhow::Error) -> u8 {
    for cause in error.chain() {
        if cause.is::<Usage>() {
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
