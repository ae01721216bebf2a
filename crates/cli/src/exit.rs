//! Exit codes: 0 done, 1 done but the asked-for criterion is not met, 2 usage, 3 bad data, 4 numerical
//! failure, 130 interrupted (143 by SIGTERM, 129 by SIGHUP).

pub use augsim_session::Usage;

use crate::interrupt;
use crate::sweep::failed::TaskFailed;
use crate::sweep::fault::SweepFault;
use augsim_data::{LimitSetting, printable};
use augsim_session::{Failure, sentence};
use augsim_tensor::TensorError;
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

/// Whether a cause is a mistake of use that only the command line knows.
fn is_mistake_of_use(cause: &(dyn std::error::Error + 'static)) -> bool {
    cause.is::<SweepFault>()
        || cause.is::<LimitSetting>()
        || matches!(cause.downcast_ref(), Some(TensorError::Simd { .. }))
}

fn code(error: &anyhow::Error) -> u8 {
    if let Some(failed) = error.chain().find_map(|cause| cause.downcast_ref::<TaskFailed>()) {
        return failed.code;
    }
    if error.chain().any(is_mistake_of_use) {
        return 2;
    }
    match Failure::of(error) {
        Failure::Usage => 2,
        Failure::Model | Failure::Data => 3,
        Failure::Numerical => 4,
    }
}
