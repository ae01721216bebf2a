//! `augsim data inspect --model` for a model of equations: the columns of the model in the data.

use super::inspect::Checked;
use super::{count_trajectories, note_conversions};
use augsim_data::Dataset;
use augsim_data::checks::Finding;
use augsim_equations::Model;
use augsim_session::DataFrom;
use augsim_session::equations::{self, degrees, records};
use augsim_terminal::output::Output;
use serde::Serialize;
use std::fmt;
use std::path::Path;

/// Output of `augsim data inspect` with a model of equations: columns that the model names, other columns, checks.
#[derive(Debug, Serialize)]
pub struct Inspection {
    trajectories: usize,
    samples: usize,
    duration_s: f64,
    columns: Vec<ColumnSummary>,
    unnamed_columns: Vec<String>,
    checks: Vec<Checked>,
}

/// Role and statistics of one column that the model names.
#[derive(Debug, Serialize)]
struct ColumnSummary {
    name: String,
    role: &'static str,
    unit: String,
    values: usize,
    rate_hz: f64,
    least: f64,
    most: f64,
    /// Limit of the sensor: the smallest or largest value, with its number of samples; `None` if they are few.
    at_limit: Option<(f64, usize)>,
    /// Quantisation step of the sensor, in `unit`; `None` unless all differences of values are multiples of it.
    step: Option<f64>,
}

/// Minimum number of samples at the smallest or largest value that indicates a limit of the sensor.
const MIN_SAMPLES_AT_LIMIT: usize = 5;
/// Maximum number of values of a column that are searched for a quantisation step.
const MAX_QUANTISATION_VALUES: usize = 20_000;

/// Reads data with a model of equations, summarises each column and runs all checks.
///
/// # Errors
/// The model or the data cannot be read, or do not match.
pub fn inspect(from: &DataFrom, model: &Path, output: &Output) -> anyhow::Result<Inspection> {
    let model = equations::read(model)?;
    let measured = records::read(from, &model)?;
    let data = &measured.data;
    note_conversions(from, data.notes(), output);
    let column = |(index, column): (usize, &augsim_data::Column)| {
        let mut values: Vec<f64> = Vec::new();
        let mut steps: Vec<f64> = Vec::new();
        for t in data.trajectories() {
            let finite = t.time_s().iter().zip(t.column(index)).filter(|(_, v)| v.is_finite());
            let (times, finite_values): (Vec<f64>, Vec<f64>) = finite.map(|(t, v)| (*t, *v)).unzip();
            steps.extend(times.windows(2).map(|p| p[1] - p[0]));
            values.extend(finite_values);
        }
        steps.sort_by(f64::total_cmp);
        let step = steps.get(steps.len() / 2).copied().unwrap_or(f64::NAN);
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let count_at = |limit: f64| values.iter().filter(|v| **v == limit).count();
        let (limit, samples_at_limit) =
            if count_at(least) > count_at(most) { (least, count_at(least)) } else { (most, count_at(most)) };
        let is_output = model.outputs.iter().any(|o| o.name == column.name());
        ColumnSummary {
            name: column.name().to_owned(),
            role: if is_output { "output" } else { "input" },
            unit: column.unit().symbol(),
            values: values.len(),
            rate_hz: 1.0 / step,
            least,
            most,
            at_limit: (is_output
                && samples_at_limit >= MIN_SAMPLES_AT_LIMIT
                && samples_at_limit * 5 < values.len())
            .then_some((limit, samples_at_limit)),
            step: is_output.then(|| quantisation(&values)).flatten(),
        }
    };
    let duration =
        |t: &augsim_data::Trajectory| t.time_s().last().zip(t.time_s().first()).map(|(b, a)| b - a);
    Ok(Inspection {
        trajectories: data.trajectories().len(),
        samples: data.trajectories().iter().map(augsim_data::Trajectory::len).sum(),
        duration_s: data.trajectories().iter().filter_map(duration).fold(0.0, f64::max),
        columns: data.columns().iter().enumerate().map(column).collect(),
        unnamed_columns: measured.unnamed,
        checks: Checked::run_all(data, &model.expected(), true, degree_finding(&model, data)?),
    })
}

/// Finds angles in degrees by fits of the model to short windows; the data alone do not show them.
fn degree_finding(model: &Model, data: &Dataset) -> anyhow::Result<Option<Finding>> {
    Ok(degrees::find(model, &records::records(data, model, true)?))
}

/// Quantisation step of the values; `None` unless all differences are multiples of it and values repeat often.
fn quantisation(values: &[f64]) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().take(MAX_QUANTISATION_VALUES).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    let range = sorted.last()? - sorted.first()?;
    let gaps: Vec<f64> = sorted.windows(2).map(|p| p[1] - p[0]).filter(|gap| *gap > 1e-9 * range).collect();
    let step = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    // A recording with few digits is not quantised by the sensor, so each value must occur four times on
    // average.
    let repeated = values.len().min(MAX_QUANTISATION_VALUES) >= 4 * sorted.len();
    let whole = |gap: &f64| ((gap / step) - (gap / step).round()).abs() < 0.01 * (gap / step).max(1.0).sqrt();
    (gaps.len() > 2 && repeated && gaps.iter().all(whole)).then_some(step)
}

impl fmt::Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}, {} rows, the longest one takes {:.3} s",
            count_trajectories(self.trajectories),
            self.samples,
            self.duration_s
        )?;
        for c in &self.columns {
            let unit = if c.unit.is_empty() { String::new() } else { format!(" {}", c.unit) };
            writeln!(
                f,
                "  {:<6} {:<24} {} values at {:.4} Hz, {:.4e} to {:.4e}{unit}",
                c.role, c.name, c.values, c.rate_hz, c.least, c.most
            )?;
            if let Some((limit, count)) = c.at_limit {
                writeln!(
                    f,
                    "    {count} values are equal to {limit}{unit}: a range with this limit in the model marks them as saturated"
                )?;
            }
            if let Some(step) = c.step {
                writeln!(
                    f,
                    "    values are multiples of {step:.4e}{unit}: declare step = {step:.4e} in the model"
                )?;
            }
        }
        if !self.unnamed_columns.is_empty() {
            writeln!(f, "columns that the model does not name: {}", self.unnamed_columns.join(", "))?;
        }
        Checked::write_all(&self.checks, f)
    }
}

/// Returns the path if the model file is one of equations.
pub fn applies(model: Option<&Path>) -> Option<&Path> {
    model.filter(|path| equations::is_model(path))
}
