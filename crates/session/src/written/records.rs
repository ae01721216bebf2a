//! Measured data as the columns of a model.

use crate::DataFrom;
use anyhow::Context;
use augsim_data::{Dataset, Trajectory, Unit, shown, shown_list};
use augsim_physics::system::{Record, Stream};
use augsim_written::Model;
use thiserror::Error;

/// Names of the long form that no model names.
const OF_THE_FORM: [&str; 4] = ["trajectory", "t_s", "group", "start_time_s"];

/// Columns of data and model that do not go together.
#[derive(Debug, Error)]
#[error(
    "{} has no column `{}`, {what} of {model}; its columns are {}",
    shown(data),
    shown(column),
    shown_list(header)
)]
struct NoColumn {
    data: String,
    column: String,
    what: &'static str,
    model: String,
    header: Vec<String>,
}

/// Data with the columns of a model.
#[derive(Debug)]
pub struct Measured {
    /// Inputs, then outputs, by their names.
    pub data: Dataset,
    /// Columns of the file that the model does not name.
    pub unnamed: Vec<String>,
}

/// Reads the columns that a model names.
///
/// # Errors
/// One of them is missing, or the file cannot be read.
pub fn read(from: impl Into<DataFrom>, model: &Model) -> anyhow::Result<Measured> {
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
    let is_named = |h: &str| named.iter().any(|(name, ..)| *name == h) || OF_THE_FORM.contains(&h);
    let unnamed = header.iter().filter(|h| !is_named(h)).cloned().collect();
    // A file may have a column that is an input and an output: it is read once.
    let mut wanted: Vec<(&str, Unit)> = Vec::new();
    for (name, unit, _) in &named {
        if !wanted.iter().any(|(there, _)| there == name) {
            wanted.push((name, unit.unwrap_or(Unit::DIMENSIONLESS)));
        }
    }
    let data = csv.read(&wanted).with_context(|| format!("data of {}", model.file))?;
    Ok(Measured { data, unnamed })
}

/// The trajectories as records of the model. For a fit, readings at or beyond the range of their output say only that it was
/// left: they are gaps (`within_range`). Scores compare them with what such a sensor would have read.
pub fn records(data: &Dataset, model: &Model, within_range: bool) -> anyhow::Result<Vec<Record>> {
    let mut list = Vec::with_capacity(data.trajectories().len());
    let places = |names: Vec<&str>| -> anyhow::Result<Vec<usize>> {
        names.into_iter().map(|name| Ok(data.column_index(name)?)).collect()
    };
    let outputs = places(model.outputs.iter().map(|o| o.name.as_str()).collect())?;
    let inputs = places(model.inputs.iter().map(|i| i.name.as_str()).collect())?;
    for trajectory in data.trajectories() {
        // Rows without any output bring inputs alone: the engine has them on their own clock.
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
