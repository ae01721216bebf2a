//! Code that reproductions on measured sets share: the data folder, the discovery on one set, the results of all sets.

use crate::args::Reproduce;
use augsim_discovery::Discovery;
use augsim_session::usage::Missing;
use augsim_terminal::Usage;
use augsim_terminal::discover_args::Discover;
use augsim_terminal::discovery::run_whole_discovery;
use augsim_terminal::output::Output;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Number of simulated data sets without a missing effect in a complete run, from which false alarms are counted.
pub const NULL_RUNS: usize = 19;

/// Content of `result.json`: one row for each set.
#[derive(Debug, Serialize)]
pub struct ResultFile<R> {
    schema: &'static str,
    scenario: &'static str,
    /// Results on the sets.
    pub sets: Vec<R>,
    /// Seed of all random draws.
    pub seed: u64,
}

impl<R> ResultFile<R> {
    /// The results of a reproduction, which is called `scenario` on the command line.
    pub fn new(scenario: &'static str, sets: Vec<R>, seed: u64) -> Self {
        Self { schema: "augsim.reproduce/1", scenario, sets, seed }
    }
}

/// Run times of the sets, s.
#[derive(Debug, Serialize)]
pub struct Times {
    sets: BTreeMap<&'static str, f64>,
}

impl Times {
    /// The run times of sets: name, and time in s.
    pub fn new(sets: impl Iterator<Item = (&'static str, f64)>) -> Self {
        Self { sets: sets.collect() }
    }
}

/// Returns the folder with all measured sets.
///
/// # Errors
/// [`Usage`] if none is given, or it is not there.
pub fn data_folder<'a>(args: &'a Reproduce, scenario: &'static str) -> anyhow::Result<&'a Path> {
    let there = args.data.as_deref().filter(|folder| folder.is_dir());
    there.ok_or_else(|| Usage::Missing(Missing::MeasuredSets { scenario }).into())
}

/// Finds what the declared model of a set lacks; the results are written to the set's folder.
///
/// # Errors
/// As [`run_whole_discovery`].
pub fn discover_set(set: &str, args: &Discover, seed: u64, output: &Output) -> anyhow::Result<Discovery> {
    // The claim of the outer folder has already decided what may be overwritten.
    let found = run_whole_discovery(args, seed, true, output)?;
    output.note(format!("{set}: {}", found.sentence));
    Ok(found)
}
