//! Exit codes: 0 success, 1 success but the requested criterion is not met, 2 usage error, 3 bad data, 4
//! numerical failure, 130 interrupted (143 by SIGTERM, 129 by SIGHUP).

use augsim_data::{LimitSettingError, escape_control_characters};
use augsim_session::{Failure, sentence};
use augsim_tensor::TensorError;
use std::io::Write;
use std::process::ExitCode;

/// Prints an error as one paragraph on standard error and returns its exit code.
pub fn report(error: &anyhow::Error) -> ExitCode {
    // Nothing can be done when standard error is closed.
    let _ = writeln!(std::io::stderr(), "augsim: error: {}", escape_control_characters(&sentence(error)));
    ExitCode::from(code(error))
}

/// Whether a cause of an error is a wrong environment variable, which counts as a usage error.
fn is_usage_error(cause: &(dyn std::error::Error + 'static)) -> bool {
    cause.is::<LimitSettingError>() || matches!(cause.downcast_ref(), Some(TensorError::Simd { .. }))
}

fn code(error: &anyhow::Error) -> u8 {
    if let Some(code) = augsim_sweep::exit_code(error) {
        return code;
    }
    if error.chain().any(is_usage_error) {
        return 2;
    }
    match Failure::classify(error) {
        Failure::Usage => 2,
        Failure::Model | Failure::Data => 3,
        Failure::Numerical => 4,
    }
}
