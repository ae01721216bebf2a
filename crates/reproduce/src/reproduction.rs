//! Code that all reproductions share: number of iterations, results folder, command line.

use crate::args::Reproduce;
use augsim_session::command_line::quoted;
use augsim_session::run_dir::CHECKPOINT;
use augsim_session::usage::PathFault;
use augsim_terminal::Usage;
use augsim_terminal::destination::{Claim, REPORT, RESULT, Results};
use augsim_terminal::record::Record;
use std::path::{Path, PathBuf};

/// Number of training iterations of the paper.
pub const ITERATIONS: u64 = 10_000;

/// Returns the command line that repeats a reproduction, quoted for a shell, with `DIR` as its results
/// folder.
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

/// Claims the results folder. Existing trained networks need `resume` (continue) or `force` (overwrite).
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

/// Returns a run directory with a checkpoint at most `depth` folders below `folder`.
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
