//! `augsim simulate`.

mod ball;
mod push;

use crate::args::{Simulate, SimulateScenario};
use crate::exit::Outcome;
use crate::output::Output;
use std::path::{Path, PathBuf};

/// Runs the subcommand.
pub fn run(args: &Simulate, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    match args.scenario {
        SimulateScenario::Ball => ball::run(args, seed, output),
        SimulateScenario::Push => push::run(args, seed, output),
    }
}

/// The file beside `out` that ends in `suffix`: `ball.csv.gz` and `truth.csv` give `ball.truth.csv`.
fn beside(out: &Path, suffix: &str) -> PathBuf {
    let name = out.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.trim_end_matches(".gz").trim_end_matches(".csv");
    out.with_file_name(format!("{stem}.{suffix}"))
}

/// The file to write, with its folder made.
fn prepared(out: Option<&Path>, default: &str) -> anyhow::Result<PathBuf> {
    let out = out.map_or_else(|| PathBuf::from(default), Path::to_path_buf);
    if let Some(folder) = out.parent() {
        std::fs::create_dir_all(folder)?;
    }
    Ok(out)
}
