//! Reads measured data in the columns of an equation model.

use crate::DataFrom;
use anyhow::Context;
use augsim_data::{Dataset, Trajectory, Unit, escaped_list, escaped_short};
use augsim_equations::Model;
use augsim_physics::system::{Record, Stream};
use thiserror::Error;

/// Columns of the long data format that are not model quantities.
const FORMAT_COLUMNS: [&str; 4] = ["trajectory", "t_s", "group", "start_time_s"];

/// The data lack a column of the model.
#[derive(Debug, Error)]
#[error(
    "{} has no column `{}`, {what} of {model}; its columns are {}",
    escaped_short(data),
    escaped_short(column),
    escaped_list(header)
)]
struct NoColumn {
    data: String,
    column: String,
    what: &'static str,
    model: String,
    header: Vec<String>,
}

/// Data in the columns of a model.
#[derive(Debug)]
pub struct ModelData {
    /// Inputs, then outputs, by name.
    pub data: Dataset,
    /// Columns of the file that the model does not use.
    pub unnamed: Vec<String>,
}

/// Reads the columns of a model's inputs and outputs.
///
/// # Errors
/// A column is missing, or the file cannot be read.
pub fn read(from: impl Into<DataFrom>, model: &Model) -> anyhow::Result<ModelData> {
    let from = from.into();
    let csv = from.named()?;
    let header = csv.header().to_vec();
    let inputs = model.inputs.iter().map(|i| (i.name.as_str(), i.unit, "an input"));
    let outputs = model.outputs.iter().map(|o| (o.name.as_str(), o.unit, "an output"));
    let named: Vec<(&str, Option<Unit>, &'static str)> = inputs.chain(outputs).collect();
    if let Some((column, _, what)) = named.iter().find(|(name, ..)| !header.iter().any(|h| h == name)) {
        let (data, model) = (from.to_string(), model.file.clone());
        return Err(NoColumn { data, column: (*column).to_owned(), what, model, header }.into());
    }
    let is_named = |h: &str| named.iter().any(|(name, ..)| *name == h) || FORMAT_COLUMNS.contains(&h);
    let unnamed = header.iter().filter(|h| !is_named(h)).cloned().collect();
    // A column may be both an input and an output; it is read once.
    let mut wanted: Vec<(&str, Unit)> = Vec::new();
    for (name, unit, _) in &named {
        if !wanted.iter().any(|(other, _)| other == name) {
            wanted.push((name, unit.unwrap_or(Unit::DIMENSIONLESS)));
        }
    }
    let data = csv.read(&wanted).with_context(|| format!("data of {}", model.file))?;
    Ok(ModelData { data, unnamed })
}

/// Converts trajectories to records of the model.
///
/// With `within_range`, readings at or beyond the sensor range of their output become gaps, since the true
/// value is unknown: use it for fits. Scores compare such readings with predictions clipped to the range.
pub fn records(data: &Dataset, model: &Model, within_range: bool) -> anyhow::Result<Vec<Record>> {
    let mut list = Vec::with_capacity(data.trajectories().len());
    let indices = |names: Vec<&str>| -> anyhow::Result<Vec<usize>> {
        names.into_iter().map(|name| Ok(data.column_index(name)?)).collect()
    };
    let outputs = indices(model.outputs.iter().map(|o| o.name.as_str()).collect())?;
    let inputs = indices(model.inputs.iter().map(|i| i.name.as_str()).collect())?;
    for trajectory in data.trajectories() {
        // Rows without an output are dropped here; their inputs are kept, since inputs have their own clock.
        let rows: Vec<usize> = (0..trajectory.len())
            .filter(|&k| outputs.iter().any(|&o| trajectory.column(o)[k].is_finite()))
            .collect();
        let at = |column: &[f64]| -> Vec<f64> { rows.iter().map(|&k| column[k]).collect() };
        let values = outputs.iter().zip(&model.outputs).map(|(&o, declared)| {
            let mut values = at(trajectory.column(o));
            if let Some([low, high]) = declared.range.filter(|_| within_range) {
                values.iter_mut().filter(|v| **v <= low || **v >= high).for_each(|v| *v = f64::NAN);
            }
            values
        });
        list.push(Record {
            id: trajectory.id().to_owned(),
            times: at(trajectory.time_s()),
            values: values.collect(),
            inputs: inputs.iter().map(|&i| stream(trajectory, i)).collect(),
            ..Record::default()
        });
    }
    Ok(list)
}

/// An input on its own clock: the rows in which it has a value.
fn stream(trajectory: &Trajectory, column: usize) -> Stream {
    let samples = trajectory.time_s().iter().zip(trajectory.column(column)).filter(|(_, v)| v.is_finite());
    let (times, values) = samples.map(|(t, v)| (*t, *v)).unzip();
    Stream { times, values: vec![values] }
}
