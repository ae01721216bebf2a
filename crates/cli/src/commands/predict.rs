//! `augsim predict`.

use crate::args::Predict;
use crate::destination::data_file;
use crate::exit::{Outcome, Usage};
use crate::output::Output;
use crate::run_data;
use crate::run_dir::{DataSource, FILES, RunDir};
use augsim_data::{Column, Dataset, Limit, Trajectory, write_dataset};
use augsim_trainer::score::quantile;
use augsim_trainer::{Forecaster, NetModel, Samples, Task};
use rayon::prelude::*;
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Written {
    forecast: PathBuf,
    trajectories: usize,
    samples: usize,
}

/// Runs the subcommand.
pub fn run(args: &Predict, output: &Output) -> anyhow::Result<Outcome> {
    let run = RunDir::open(&args.run);
    let trained = FILES.map(|name| run.file(name));
    let inputs: Vec<&Path> = trained.iter().chain([&args.data]).map(PathBuf::as_path).collect();
    data_file(&args.out, &[], &inputs)?;
    let model = NetModel::new(run.read_model()?)?;
    let source = DataSource::File(args.data.clone());
    let (starts, times) = run_data::load_timed(&source, &model.state().settings.engine)?;
    let samples = args.samples as usize;
    let longest = starts.items.iter().map(|q| q.time).max().unwrap_or(0) as u64;
    let cells = u64::from(args.samples).saturating_mul(longest).saturating_mul(starts.columns.len() as u64);
    Limit::Cells.check(cells).map_err(|e| Usage(format!("--samples {samples}: each forecast {e}")))?;
    let rows = starts
        .items
        .par_iter()
        .zip(&times)
        .enumerate()
        .map(|(i, (q, t))| {
            let task = Task { start: q.state(0), actions: &q.actions, time: q.time, index: i as u64 };
            let columns = summarise(&model.forecast(task, samples)?, q.time);
            Ok(Trajectory::new(q.id.clone(), t.clone(), columns)?)
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let names = starts.columns.iter().flat_map(|c| column_names(c)).collect::<Vec<_>>();
    let columns = names.iter().map(|n| Column::new(n)).collect::<Result<Vec<_>, _>>()?;
    write_dataset(&Dataset::new(columns, rows)?, &args.out)?;
    let written = Written { forecast: args.out.clone(), trajectories: starts.items.len(), samples };
    output.result(&written, || {
        format!(
            "{} forecasts from the first state, {} samples each: {}",
            written.trajectories,
            samples,
            written.forecast.display()
        )
    })?;
    Ok(Outcome::Done)
}

/// What is written of each column, in order.
const STATISTICS: [&str; 6] = ["mean", "median", "q05", "q25", "q75", "q95"];

/// `velocity_m_s` to `mean_velocity_m_s` and so on: the unit stays the suffix.
fn column_names(column: &str) -> [String; 6] {
    STATISTICS.map(|s| format!("{s}_{column}"))
}

/// The statistics of every column over the samples, at each time.
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
