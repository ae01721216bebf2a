//! Reads measured data in the columns of an equation model.

use crate::DataFrom;
use anyhow::Context;
use augsim_data::{Dataset, NamedCsv, Trajectory, Unit, escaped_list, escaped_short};
use augsim_equations::Model;
use augsim_system::{Record, RecordReader};
use std::collections::BTreeSet;
use thiserror::Error;

/// Names of the columns of the long data format that are not model quantities.
const FORMAT_COLUMNS: [&str; 4] = ["trajectory", "t_s", "group", "start_time_s"];

/// Error: the data lack a column that the model needs.
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

/// Error: a column that the model needs has no value in a trajectory.
#[derive(Debug, Error)]
#[error(
    "{}, trajectory `{}`: column `{}`, {what} of {model}, has no value; export it again, or remove the trajectory",
    escaped_short(data),
    escaped_short(trajectory),
    escaped_short(column)
)]
struct NoValues {
    data: String,
    trajectory: String,
    column: String,
    what: &'static str,
    model: String,
}

/// Measured data in the columns of an equation model.
#[derive(Debug)]
pub struct ModelData {
    /// Data whose columns are the inputs of the model, then its outputs, by name.
    pub data: Dataset,
    /// Names of the columns in the file that the model does not use.
    pub unnamed: Vec<String>,
}

/// Columns that a model reads: name, unit, and whether it is an input or an output.
///
/// A column that is both is listed once.
fn columns_of(model: &Model) -> Vec<(&str, Option<Unit>, &'static str)> {
    let inputs = model.inputs.iter().map(|i| (i.name.as_str(), i.unit, "an input"));
    let outputs = model.outputs.iter().map(|o| (o.name.as_str(), o.unit, "an output"));
    let mut columns: Vec<(&str, Option<Unit>, &'static str)> = Vec::new();
    for column in inputs.chain(outputs) {
        if !columns.iter().any(|(name, ..)| *name == column.0) {
            columns.push(column);
        }
    }
    columns
}

fn with_units<'m>(columns: &[(&'m str, Option<Unit>, &str)]) -> Vec<(&'m str, Unit)> {
    columns.iter().map(|(name, unit, _)| (*name, unit.unwrap_or(Unit::DIMENSIONLESS))).collect()
}

/// Data whose header was read, so that the unit conversions are known before the rows are read.
#[derive(Debug)]
pub struct OpenTable {
    from: DataFrom,
    csv: NamedCsv,
}

/// Opens measured data in the columns of an equation model; reads only the header.
///
/// # Errors
/// The file cannot be opened.
pub fn open(from: impl Into<DataFrom>) -> anyhow::Result<OpenTable> {
    let from = from.into();
    let csv = from.named()?;
    Ok(OpenTable { from, csv })
}

impl OpenTable {
    /// Sentences on the column taken as time and on the unit conversions of the model's columns.
    pub fn reading(&self, model: &Model) -> Vec<String> {
        self.csv.notes(&with_units(&columns_of(model)))
    }

    /// Reads the data columns of a model's inputs and outputs.
    ///
    /// # Errors
    /// As [`read`].
    pub fn read(self, model: &Model) -> anyhow::Result<ModelData> {
        let Self { from, csv } = self;
        let columns = columns_of(model);
        if let Some((column, _, what)) = columns.iter().find(|(name, unit, _)| !csv.has_column(name, *unit)) {
            let (data, model, header) = (from.to_string(), model.file.clone(), csv.header().to_vec());
            return Err(NoColumn { data, column: (*column).to_owned(), what, model, header }.into());
        }
        let wanted = with_units(&columns);
        let mut unnamed = csv.other_columns(&wanted);
        unnamed.retain(|name| !FORMAT_COLUMNS.contains(&name.as_str()));
        let data = csv.read(&wanted).with_context(|| format!("data of {}", model.file))?;
        check_values(&from, model, &data)?;
        Ok(ModelData { data, unnamed })
    }
}

/// Opens data; returns sentences on the column taken as time and on the unit conversions of the model's columns.
///
/// # Errors
/// The file cannot be opened.
pub fn reading(from: &DataFrom, model: &Model) -> anyhow::Result<Vec<String>> {
    Ok(open(from)?.reading(model))
}

/// Opens data and reads the columns of a model's inputs and outputs.
///
/// The notes of the data set state the clock and the conversions of units.
///
/// # Errors
/// A column is missing, an input or all outputs have no value in a trajectory, or the file cannot be read.
pub fn read(from: impl Into<DataFrom>, model: &Model) -> anyhow::Result<ModelData> {
    open(from)?.read(model)
}

/// Checks that each trajectory has values of every input and of at least one output.
fn check_values(from: &DataFrom, model: &Model, data: &Dataset) -> anyhow::Result<()> {
    let has_values = |t: &Trajectory, name: &str| -> anyhow::Result<bool> {
        Ok(t.column(data.column_index(name)?).iter().any(|v| v.is_finite()))
    };
    for t in data.trajectories() {
        let no_values = |column: &str, what| NoValues {
            data: from.to_string(),
            trajectory: t.id().to_owned(),
            column: column.to_owned(),
            what,
            model: model.file.clone(),
        };
        for input in &model.inputs {
            if !has_values(t, &input.name)? {
                return Err(no_values(&input.name, "an input").into());
            }
        }
        // A sensor may be absent from a trajectory where another one measures it.
        let mut is_measured = false;
        for output in &model.outputs {
            is_measured |= has_values(t, &output.name)?;
        }
        if let Some(output) = model.outputs.first().filter(|_| !is_measured) {
            let what = if model.outputs.len() == 1 { "an output" } else { "as every output" };
            return Err(no_values(&output.name, what).into());
        }
    }
    for output in &model.outputs {
        let mut is_measured = false;
        for t in data.trajectories() {
            is_measured |= has_values(t, &output.name)?;
        }
        if let Some(t) = data.trajectories().first().filter(|_| !is_measured) {
            let trajectory = format!("{} and all others", t.id());
            let (data, column, model) = (from.to_string(), output.name.clone(), model.file.clone());
            return Err(NoValues { data, trajectory, column, what: "an output", model }.into());
        }
    }
    Ok(())
}

/// The model with a value for every group in the data, in each parameter with values by group.
///
/// A group that the model does not know gets the nominal value.
pub fn with_groups_of(model: &Model, data: &Dataset) -> Model {
    let names: BTreeSet<&str> = data.trajectories().iter().filter_map(Trajectory::group).collect();
    let mut model = model.clone();
    for p in &mut model.parameters {
        let Some(by_group) = &mut p.by_group else { continue };
        let missing = names.iter().filter(|name| !by_group.values.iter().any(|(known, _)| known == **name));
        let missing: Vec<(String, f64)> = missing.map(|name| ((*name).to_owned(), p.nominal)).collect();
        by_group.values.extend(missing);
    }
    model
}

/// Converts trajectories to records of the model.
///
/// The group of a record is its index in [`Model::group_names`], or their number for a group that the model does not
/// know.
///
/// With `within_range`, readings at or beyond the sensor range of their output become gaps, since the true
/// value is unknown: use it for fits. Scores compare such readings with predictions clipped to the range.
pub fn records(data: &Dataset, model: &Model, within_range: bool) -> anyhow::Result<Vec<Record>> {
    let channels = model.outputs.iter().map(|o| o.name.as_str());
    let reader = RecordReader::with_columns(channels, model.inputs.iter().map(|i| i.name.as_str()), data)?;
    let groups = model.group_names();
    let read = |t: &Trajectory| {
        let group = groups.iter().position(|name| Some(name.as_str()) == t.group());
        Record { group: group.unwrap_or(groups.len()), ..reader.read(t) }
    };
    let mut records: Vec<Record> = data.trajectories().iter().map(read).collect();
    if within_range {
        for record in &mut records {
            for (values, output) in record.values.iter_mut().zip(&model.outputs) {
                let Some([low, high]) = output.range else { continue };
                values.iter_mut().filter(|v| **v <= low || **v >= high).for_each(|v| *v = f64::NAN);
            }
        }
    }
    Ok(records)
}
