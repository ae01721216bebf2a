//! `augsim simulate`: simulates a model file or generates data of a built-in scenario.

mod ball;
mod like;
mod push;
mod system;

use crate::args::{Simulate, SimulateScenario};
use augsim_session::usage::ModelFault;
use augsim_session::{ModelOrRun, equations};
use augsim_terminal::destination::data_file;
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};
use std::path::{Path, PathBuf};

/// Runs `augsim simulate`: simulates a model file or generates data of a built-in scenario.
pub fn run(args: &Simulate, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    if let Some(given) = args.model.as_ref().or(args.named_model.as_ref()) {
        return match ModelOrRun::from_path(given)? {
            ModelOrRun::Net => Err(Usage::model(given.display(), ModelFault::NetSimulated).into()),
            ModelOrRun::Model { file, .. } if equations::is_model(&file) => system::run(args, &file, output),
            ModelOrRun::Model { file, .. } => like::run(args, &file, seed, output),
        };
    }
    match args.scenario {
        SimulateScenario::Ball => ball::run(args, seed, output),
        SimulateScenario::Push => push::run(args, seed, force, output),
    }
}

/// Path of a file next to `out`: `ball.csv.gz` with the suffix `truth.csv` gives `ball.truth.csv`.
fn sibling_path(out: &Path, suffix: &str) -> PathBuf {
    let name = out.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.trim_end_matches(".gz").trim_end_matches(".csv").trim_end_matches(".npz");
    out.with_file_name(format!("{stem}.{suffix}"))
}

/// Returns the output file and the files next to it, one for each of `suffixes`.
///
/// It checks that they can be written and makes their folder.
fn prepare_output<const N: usize>(
    out: Option<&Path>,
    default: &str,
    suffixes: [&str; N],
) -> anyhow::Result<(PathBuf, [PathBuf; N])> {
    let out = out.map_or_else(|| PathBuf::from(default), Path::to_path_buf);
    let others = suffixes.map(|suffix| sibling_path(&out, suffix));
    data_file(&out, &others, &[])?;
    Ok((out, others))
}
