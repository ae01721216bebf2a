#![doc = include_str!("../README.md")]
// Without the feature the crate is empty, so that workspace commands need no Python.
#![cfg(feature = "extension-module")]

mod background;
mod discovery;
mod error;
mod external;
mod generated;
mod known_threads;
mod model;
mod next;
mod numbers;
mod robot;
mod run;
mod source;
mod start;
mod stepper;

use pyo3::prelude::*;

/// Native functions and classes on which the Python package `augsim` is built; not for direct use.
#[pymodule]
mod _augsim {
    #[pymodule_export]
    use super::discovery::{Discovery, discover};
    #[pymodule_export]
    use super::external::end_functions;
    #[pymodule_export]
    use super::generated::{Laboratory, drops, pushes};
    #[pymodule_export]
    use super::model::Model;
    #[pymodule_export]
    use super::next::{Plan, next};
    #[pymodule_export]
    use super::robot::from_robot;
    #[pymodule_export]
    use super::run::{Run, read_run, train};
    #[pymodule_export]
    use super::source::{Data, Source, read};
    #[pymodule_export]
    use super::start::{start_files, start_table};
    #[pymodule_export]
    use super::stepper::Stepper;
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
