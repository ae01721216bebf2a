//! `augsim simulate MODEL --like DATA` for balls and pushes: simulates at the times of measured
//! trajectories.

use crate::args::Simulate;
use crate::commands::count_trajectories;
use augsim_data::write_dataset;
use augsim_discovery::PredictOptions;
use augsim_session::predict::{self, table};
use augsim_session::usage::{Inapplicable, ModelFault};
use augsim_session::{DataFrom, Subject};
use augsim_terminal::destination::data_file;
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Written {
    data: PathBuf,
    trajectories: usize,
    samples: usize,
    /// Description of the samples from which the initial states were estimated.
    start: String,
}

/// Simulates a model at the times of measured trajectories, from initial states estimated from them.
pub(super) fn run(args: &Simulate, file: &Path, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    let model = Subject::read(file)?;
    let Some(like) = &args.like else {
        return Err(Usage::model(file.display(), ModelFault::BuiltInWithoutTimes).into());
    };
    if !args.start.is_empty() || args.check {
        return Err(Usage::Inapplicable(Inapplicable::StartOfBuiltIn).into());
    }
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("out/{}.csv", model.scenario())));
    data_file(&out, &[], &[file, like])?;
    let options = PredictOptions { seed, draws: predict::DRAWS, only: None };
    let all = predict::predict(&model, &DataFrom::from(like), 1, &options)?;
    write_dataset(&table::trajectories(&all)?, &out)?;
    let samples = all.records.iter().map(|r| r.times.len()).sum();
    let written = Written { data: out, trajectories: all.records.len(), samples, start: all.start };
    output.result(&written, || {
        format!(
            "{}, {} samples, from {}, with the limits of the 90 % bands: {}",
            count_trajectories(written.trajectories),
            written.samples,
            written.start,
            written.data.display()
        )
    })?;
    Ok(Outcome::Done)
}
