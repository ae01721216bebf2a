//! Errors as Python's exceptions, with the sentences of the command line.

use augsim_session::{Failure, sentence};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The module of the package in which the exceptions are declared.
const MODULE: &str = "augsim._errors";

/// An exception of the package, by the name of its class.
fn exception(py: Python<'_>, class: &str, text: String) -> PyErr {
    let raised = || py.import(MODULE)?.getattr(class)?.call1((text,));
    raised().map_or_else(|e| e, PyErr::from_value)
}

/// The exception for an error: its class says what kind of mistake it is.
pub fn raised(py: Python<'_>, error: &anyhow::Error) -> PyErr {
    let class = match Failure::of(error) {
        Failure::Usage => "UsageError",
        Failure::Model => "ModelError",
        Failure::Data => "DataError",
        Failure::Numerical => "NumericalError",
    };
    exception(py, class, augsim_data::printable(&sentence(error)))
}

/// The exception for a panic, which is a defect: no panic crosses into Python.
pub fn defect(panic: Box<dyn Any + Send>) -> PyErr {
    let text = match (panic.downcast_ref::<&str>(), panic.downcast_ref::<String>()) {
        (Some(text), _) => (*text).to_owned(),
        (None, Some(text)) => text.clone(),
        (None, None) => "no reason given".to_owned(),
    };
    PyRuntimeError::new_err(format!("a defect of augsim, please report it: {text}"))
}

/// Does short work on the calling thread without the interpreter's lock.
///
/// # Errors
/// The exception for its error, or for a panic.
pub fn unlocked<T: Send>(py: Python<'_>, work: impl FnOnce() -> anyhow::Result<T> + Send) -> PyResult<T> {
    match py.detach(|| catch_unwind(AssertUnwindSafe(work))) {
        Ok(result) => result.map_err(|e| raised(py, &e)),
        Err(panic) => Err(defect(panic)),
    }
}
