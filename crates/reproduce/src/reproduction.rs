//! Code that all reproductions share: number of iterations, results folder, command line, output files.

use crate::args::Reproduce;
use augsim_report::page::{Block, Provenance, Section};
use augsim_session::command_line::quoted;
use augsim_session::run_dir::{CHECKPOINT, DataSource};
use augsim_session::usage::PathFault;
use augsim_terminal::destination::{Claim, REPORT, RESULT, Results};
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use augsim_terminal::{Outcome, Usage};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Number of training iterations in the paper.
const ITERATIONS: u64 = 10_000;
/// Number of training drops that are generated, as in the paper.
const TRAINING_DROPS: usize = 800;
/// Offset of the seed between training and test data, so that their random draws differ.
const TEST_SEED_OFFSET: u64 = 1_000_000;

/// Returns the number of training iterations: the given one, that of the paper, or a tenth with `--quick`.
pub fn iterations(args: &Reproduce) -> u64 {
    args.iterations.unwrap_or(if args.quick { ITERATIONS / 10 } else { ITERATIONS })
}

/// Returns the seed of the test data.
pub fn test_seed(seed: u64) -> u64 {
    seed.wrapping_add(TEST_SEED_OFFSET)
}

/// Returns the sources of training and test drops: files of the data folder, or generated drops.
pub fn drop_sources(args: &Reproduce, data: Option<&Path>, seed: u64) -> (DataSource, DataSource) {
    match data {
        Some(folder) => {
            let file = |name: &str| DataSource::File(folder.join(name));
            (file("train.csv.gz"), file("test_1000.csv.gz"))
        }
        None => {
            let drops = |trajectories, seed| DataSource::DropDistribution { trajectories, seed };
            (drops(TRAINING_DROPS, seed), drops(args.test_drops as usize, test_seed(seed)))
        }
    }
}

/// Adds the files of training and test data to the record of the inputs.
pub fn record_sources(mut record: Record, train: &DataSource, test: &DataSource) -> Record {
    for (name, source) in [("train", train), ("test", test)] {
        if let DataSource::File(path) = source {
            record = record.input(name, path);
        }
    }
    record
}

/// Returns the command line, quoted for a shell, that repeats a reproduction with `DIR` as results folder.
pub fn repeat(words: Vec<String>) -> String {
    let head = ["augsim", "reproduce"].map(str::to_owned);
    let all: Vec<String> = head.into_iter().chain(words).chain(["--out", "DIR"].map(str::to_owned)).collect();
    quoted(&all)
}

/// Returns the command line that repeats a reproduction on the measured sets of a folder.
pub fn repeat_on_data(scenario: &str, args: &Reproduce, data: &Path, seed: u64) -> String {
    let mut words = vec![scenario.to_owned(), "--data".to_owned(), data.display().to_string()];
    if args.quick {
        words.push("--quick".to_owned());
    }
    if let Some(iterations) = args.iterations {
        words.extend(["--iterations".to_owned(), iterations.to_string()]);
    }
    words.extend(["--seed".to_owned(), seed.to_string()]);
    repeat(words)
}

/// Reserves the results folder for this run.
///
/// Existing trained networks need `resume` (continue) or `force` (overwrite).
pub fn claim(
    folder: &Path,
    record: Record,
    inputs: &[&Path],
    resume: bool,
    force: bool,
) -> anyhow::Result<Claim> {
    let claim = Results { folder, files: &[RESULT, REPORT], inputs, record, force }.claim()?;
    if let Some(net) = trained_net(folder, 2).filter(|_| !resume && !force) {
        return Err(Usage::path(&net, PathFault::NetOfReproduction).into());
    }
    Ok(claim)
}

/// Writes the result file, the report with the HTML of `page` and the run times, and prints the result.
///
/// `table` is the text for people. Without `times` no file of run times is written.
pub fn finish<R: Serialize>(
    claim: &Claim,
    result: &R,
    page: impl FnOnce(&R) -> anyhow::Result<String>,
    times: Option<impl Serialize>,
    table: impl FnOnce(&R) -> String,
    output: &Output,
) -> anyhow::Result<Outcome> {
    let report = write_results(claim, result, page, times)?;
    output.result(result, || format!("{}report: {}", table(result), report.display()))?;
    Ok(Outcome::Done)
}

/// Writes the result file, the report and, if given, the run times; returns the path of the report.
pub fn write_results<R: Serialize>(
    claim: &Claim,
    result: &R,
    page: impl FnOnce(&R) -> anyhow::Result<String>,
    times: Option<impl Serialize>,
) -> anyhow::Result<PathBuf> {
    claim.write(RESULT, &serde_json::to_string_pretty(result)?)?;
    let report = claim.write(REPORT, &page(result)?)?;
    times.map(|times| claim.write_timing(times)).transpose()?;
    Ok(report)
}

/// Returns the last section of a report page: the command that repeats the run.
pub fn how_to_reproduce(command: &str) -> Section {
    let code = Block::Code { caption: String::new(), text: command.to_owned() };
    Section::new("How to reproduce", vec![code])
}

/// Returns version and seed for a report page, with the data folder if the data are measured.
pub fn provenance(seed: u64, data: Option<&Path>) -> Provenance {
    Provenance {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed: Some(seed),
        more: data.map(|data| ("data".to_owned(), data.display().to_string())).into_iter().collect(),
        ..Default::default()
    }
}

/// Finds a run directory with a checkpoint at most `depth` folders below `folder`; `None` if there is none.
fn trained_net(folder: &Path, depth: u32) -> Option<PathBuf> {
    if depth == 0 {
        return None;
    }
    let inner = std::fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path()).filter(|p| p.is_dir());
    let mut inner: Vec<PathBuf> = inner.collect();
    inner.sort_unstable();
    inner.into_iter().find_map(|path| match path.join(CHECKPOINT).exists() {
        true => Some(path),
        false => trained_net(&path, depth - 1),
    })
}
