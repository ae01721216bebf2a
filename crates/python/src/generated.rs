//! Trajectories that our generators make: for examples, and for trying things out.

use crate::background;
use crate::model::Model;
use crate::source::Data;
use augsim_data::Limit;
use augsim_physics::ball::paper_law::PaperLaw;
use augsim_physics::model::ModelFile;
use augsim_physics::push::laboratory::Protocol;
use augsim_session::run_data::recipe;
use augsim_session::{Subject, Usage};
use pyo3::prelude::*;

/// Refuses more trajectories than the limit of data sets.
fn check(trajectories: usize) -> Result<(), Usage> {
    if trajectories == 0 {
        return Err(Usage("trajectories = 0: make at least one".to_owned()));
    }
    Limit::Trajectories
        .check(trajectories as u64)
        .map_err(|e| Usage(format!("trajectories = {trajectories}: the set {e}")))
}

/// Drops of the paper's law.
#[pyfunction]
pub fn drops(py: Python<'_>, trajectories: usize, samples: usize, seed: u64) -> PyResult<Data> {
    let made = background::run(py, None, move |_| {
        check(trajectories)?;
        Limit::Cells
            .check((trajectories as u64).saturating_mul(samples as u64))
            .map_err(|e| Usage(format!("samples = {samples}: the set {e}")))?;
        Ok(PaperLaw { samples, ..PaperLaw::default() }.generate(trajectories, seed)?.0)
    })?;
    Data::of(py, made)
}

/// Pushes of the virtual laboratory, laid out as the MIT set, and the model that is declared for them.
#[pyfunction]
pub fn pushes(
    py: Python<'_>,
    trajectories: usize,
    surface: String,
    shape: String,
    seed: u64,
) -> PyResult<(Data, Model)> {
    let made = background::run(py, None, move |_| {
        check(trajectories)?;
        Ok(recipe(Protocol::Mit, &shape, &surface, trajectories)?.generate(seed)?)
    })?;
    let subject = Subject::BuiltIn(Box::new(ModelFile::Push(made.declared)));
    Ok((Data::of(py, made.data)?, Model { subject, path: None }))
}
