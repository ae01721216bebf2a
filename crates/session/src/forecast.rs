//! Forecasts of a trained net, summarised over their samples.

use crate::Usage;
use crate::predict::check_draws;
use crate::usage::{Oversized, Takes};
use augsim_data::{Column, Dataset, Limit, Trajectory, Unit};
use augsim_trainer::score::quantile;
use augsim_trainer::{Forecaster, NetModel, Samples, Sequences, Task, check_finite, collect_in_order};
use rayon::prelude::*;

/// Names of the statistics that are listed for each column, in the order of the output columns.
const STATISTICS: [&str; 6] = ["mean", "median", "q05", "q25", "q75", "q95"];

/// Forecasts from the first state of each trajectory: mean, median, 50 % and 90 % bands.
///
/// Draws `samples` forecasts of each trajectory at `times`, s, `[trajectory][sample]`.
///
/// # Errors
/// Too many samples for the memory limit, or a forecast that is not finite.
pub fn bands(
    model: &NetModel,
    starts: &Sequences,
    times: &[Vec<f64>],
    samples: usize,
) -> anyhow::Result<Dataset> {
    let longest = starts.items.iter().map(|q| q.time).max().unwrap_or(0);
    check_size(1, samples, longest, starts.columns.len())?;
    let rows = starts.items.par_iter().zip(times).enumerate().map(|(i, (q, t))| {
        let task = Task { start: q.state(0), actions: &q.actions, time: q.time, index: i as u64 };
        let forecast = model.forecast(task, samples)?;
        check_finite(&forecast, q)?;
        anyhow::Ok((q.id.clone(), t.clone(), forecast))
    });
    summarised(&starts.columns, collect_in_order(rows)?)
}

/// Summarises sampled forecasts: mean, median, 50 % and 90 % bands of every column.
///
/// Each of `rows` has the name, the times in s and the samples `[time, column, sample]` of a trajectory.
///
/// # Errors
/// An invalid column name.
pub fn summarised(columns: &[String], rows: Vec<(String, Vec<f64>, Samples)>) -> anyhow::Result<Dataset> {
    let row = |(id, times, samples): (String, Vec<f64>, Samples)| {
        let columns = summarise(&samples, times.len());
        Trajectory::new(id, times, columns)
    };
    let rows = collect_in_order(rows.into_par_iter().map(row))?;
    let statistics = |column: &String| {
        // A column of an equation model need not have a unit suffix; then the unit is unknown here.
        let unit = Column::new(column).map_or(Unit::DIMENSIONLESS, |c| c.unit());
        column_names(column).map(|name| Column::with_unit(&name, unit))
    };
    let columns = columns.iter().flat_map(statistics).collect::<Result<Vec<_>, _>>()?;
    Ok(Dataset::new(columns, rows)?)
}

/// Checks that forecasts of this size fit into the memory limit: values over all trajectories and samples.
///
/// # Errors
/// [`Usage`], if they do not, or if `samples` is 0.
pub fn check_size(trajectories: usize, samples: usize, time: usize, columns: usize) -> Result<(), Usage> {
    if samples == 0 {
        return Err(Usage::option("--samples", 0, Takes::AtLeastOne));
    }
    let sizes = [trajectories, samples, time, columns];
    let cells = sizes.into_iter().fold(1_u64, |cells, size| cells.saturating_mul(size as u64));
    let oversized = Oversized::Forecasts { samples };
    Limit::Cells.check(cells).map_err(|exceeded| Usage::Limit { oversized, exceeded })?;
    check_draws(samples)
}

/// Names of a column's statistics, e.g. `mean_velocity_m_s`: the unit stays the suffix.
fn column_names(column: &str) -> [String; 6] {
    STATISTICS.map(|s| format!("{s}_{column}"))
}

/// Computes the statistics of each column over the samples, `[column and statistic][time]`.
fn summarise(samples: &Samples, time: usize) -> Vec<Vec<f64>> {
    let columns = samples.values.len() / samples.count / time;
    let mut out = vec![Vec::with_capacity(time); columns * STATISTICS.len()];
    for (row, values) in samples.values.chunks_exact(samples.count).enumerate() {
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f32::total_cmp);
        let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64;
        let quantiles = [0.5, 0.05, 0.25, 0.75, 0.95].map(|q| quantile(&sorted, q));
        let first = row % columns * STATISTICS.len();
        out[first].push(mean);
        for (slot, q) in out[first + 1..].iter_mut().zip(quantiles) {
            slot.push(q);
        }
    }
    out
}
