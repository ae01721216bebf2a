//! Converts errors to Python exceptions with the messages of the command line.

use augsim_session::{Failure, sentence};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Python module that declares the exception classes of the package.
const MODULE: &str = "augsim._errors";

/// Creates an exception of the package from its class name and message.
pub fn exception(py: Python<'_>, class: &str, text: String) -> PyErr {
    let raised = || py.import(MODULE)?.getattr(class)?.call1((text,));
    raised().map_or_else(|e| e, PyErr::from_value)
}

/// Converts an error to the Python exception of its kind.
pub fn raised(py: Python<'_>, error: &anyhow::Error) -> PyErr {
    let class = match Failure::classify(error) {
        Failure::Usage => "UsageError",
        Failure::Model => "ModelError",
        Failure::Data => "DataError",
        Failure::Numerical => "NumericalError",
    };
    exception(py, class, augsim_data::escape_control_characters(&sentence(error)))
}

/// Converts a panic, which is a bug, to a Python exception. No panic may cross into Python.
pub fn defect(panic: Box<dyn Any + Send>) -> PyErr {
    let text = match (panic.downcast_ref::<&str>(), panic.downcast_ref::<String>()) {
        (Some(text), _) => (*text).to_owned(),
        (None, Some(text)) => text.clone(),
        (None, None) => "no reason given".to_owned(),
    };
    PyRuntimeError::new_err(format!("this is a bug in augsim, please report it: {text}"))
}

/// Runs short work on the calling thread without the GIL, Python's global lock.
///
/// The Python exception of an error or a panic in the work.
pub fn unlocked<T: Send>(py: Python<'_>, work: impl FnOnce() -> anyhow::Result<T> + Send) -> PyResult<T> {
    match py.detach(|| catch_unwind(AssertUnwindSafe(work))) {
        Ok(result) => result.map_err(|e| raised(py, &e)),
        Err(panic) => Err(defect(panic)),
    }
}
