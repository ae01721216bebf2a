//! Drafts models for recordings in any layout.

use crate::error::{exception, raised, unlocked};
use crate::source::{Data, Source};
use augsim_data::{ColumnMapping, MissingCells, RecognitionOptions};
use augsim_session::Usage;
use augsim_session::start::{Started, from_data, from_files};
use augsim_session::usage::Takes;
use pyo3::prelude::*;
use std::path::PathBuf;

/// A drafted model: data, text of the model file, kind of the recording, assumptions, height of the floor in m, inputs and outputs.
type Drafted = (Data, Option<String>, &'static str, Vec<String>, Option<f64>, Vec<String>, Vec<String>);

/// Layout of files as the caller states it, in the order of [`RecognitionOptions`]; each `None` is inferred.
type Layout =
    (Option<char>, Option<char>, Option<String>, Option<String>, Vec<String>, Option<String>, Option<f64>);

/// Reads files in any layout and drafts a model file for them.
#[pyfunction]
pub fn start_files(py: Python<'_>, paths: Vec<PathBuf>, layout: Layout) -> PyResult<Drafted> {
    let (separator, decimal, time, trajectory, columns, up, rate_hz) = layout;
    if let Some(rate) = rate_hz.filter(|rate| !(*rate > 0.0 && rate.is_finite())) {
        return Err(raised(py, &Usage::keyword("rate_hz", rate, Takes::Positive).into()));
    }
    let mapping = |text: &String| {
        text.parse::<ColumnMapping>().map_err(|e| exception(py, "UsageError", format!("columns: {e}")))
    };
    let columns = columns.iter().map(mapping).collect::<PyResult<Vec<_>>>()?;
    let layout = RecognitionOptions { separator, decimal, time, trajectory, columns, up, rate_hz };
    let started = unlocked(py, || Ok(from_files(&paths, &layout)?))?;
    drafted(py, started)
}

/// Drafts a model file for a table in memory.
#[pyfunction]
pub fn start_table(py: Python<'_>, data: &Source, name: &str) -> PyResult<Drafted> {
    let from = data.from.clone();
    let started = unlocked(py, || Ok(from_data(from.read(MissingCells::AsGap)?, name)))?;
    drafted(py, started)
}

fn drafted(py: Python<'_>, started: Started) -> PyResult<Drafted> {
    let Started { data, model, recording, assumptions, floor_height_m, drafted } = started;
    let (inputs, outputs) = drafted.map_or_else(Default::default, |d| (d.inputs, d.outputs));
    let data = Data::from_dataset(py, data)?;
    Ok((data, model, recording.name(), assumptions, floor_height_m, inputs, outputs))
}
