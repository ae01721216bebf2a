//! Runs a discovery from the command line: progress on the terminal and result files in a folder.

use crate::destination::{Claim, REPORT, RESULT, Results};
use crate::discover_args::{Discover, Library};
use crate::output::Output;
use crate::progress::Steps;
use crate::record::Record;
use augsim_discovery::{Discovery, Options};
use augsim_session::discovery_page::page;
use augsim_session::equations::figures::figures;
use augsim_session::equations::records;
use augsim_session::usage::Takes;
use augsim_session::{DiscoverRequest, ReportContext, Subject, Usage, discover};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Name of the augmented model.
const MODEL: &str = "model.toml";

/// Runs the discovery and writes `result.json`, `model.toml` and `report.html`. `force` replaces the
/// results of another run in the folder.
pub fn run_discovery(args: &Discover, seed: u64, force: bool, output: &Output) -> anyhow::Result<Discovery> {
    let claim = claim(args, seed, force)?;
    let accept = args.accept.accept.clone();
    let accepted = accept.iter().copied().collect();
    let library = args.library == Library::Generic;
    let options = Options { seed, null_runs: args.null_runs, accepted, library, until: until(args)? };
    let request = DiscoverRequest { groups: args.group.clone(), accept, options };
    let steps = Steps::new(output);
    let mut show = |p: augsim_discovery::Progress| steps.show_part(p.describe(), p.fraction());
    let subject = Subject::read(&args.model)?;
    let data = args.time.of_all(&args.data);
    // Before the search, so that one that fails on a wrong unit still says which unit was taken.
    let reading = match &subject {
        Subject::Equations(model) => records::reading(&data, model)?.join("; "),
        Subject::BuiltIn(_) => String::new(),
    };
    if !reading.is_empty() {
        output.note(format!("{data}: {reading}"));
    }
    let found = discover(&subject, &data, &request, &mut show)?;
    steps.finish();
    output.warn(&found.warnings);
    let is_new = |note: &&String| reading.is_empty() || !note.contains(&reading);
    found.notes.iter().filter(is_new).for_each(|note| output.note(note));

    claim.begin()?;
    claim.write(RESULT, &serde_json::to_string_pretty(&found)?)?;
    claim.write(MODEL, &found.model_toml)?;
    let mut context = ReportContext::new(Some(&args.model), &data, &request, &args.out);
    context.figures = figures(&subject, &found, &data);
    claim.write(REPORT, &page(&context, &subject, &found).render())?;
    claim.write_timing(())?;
    Ok(found)
}

/// Returns the time at which the search ends if a limit was set.
fn until(args: &Discover) -> anyhow::Result<Option<Instant>> {
    let Some(seconds) = args.time_limit else { return Ok(None) };
    let limit = Duration::try_from_secs_f64(seconds).ok().filter(|limit| !limit.is_zero());
    let until = limit.and_then(|limit| Instant::now().checked_add(limit));
    let wrong = || Usage::option("--time-limit", seconds, Takes::PositiveSeconds);
    Ok(Some(until.ok_or_else(wrong)?))
}

/// Claims the results folder for these settings and inputs.
fn claim(args: &Discover, seed: u64, force: bool) -> anyhow::Result<Claim> {
    let record = Record::new("discover")
        .setting("seed", seed)
        .setting("null-runs", args.null_runs)
        .setting("library", args.library.word())
        .setting("group", args.group.join(", "))
        .setting("accept", args.accept.accept.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "))
        .input("model", &args.model)
        .inputs("data", &args.data);
    let record = match &args.time.time {
        Some(time) => record.setting("time", time),
        None => record,
    };
    let record = match args.time_limit {
        Some(seconds) => record.setting("time-limit", seconds),
        None => record,
    };
    let inputs: Vec<&Path> = [&args.model].into_iter().chain(&args.data).map(PathBuf::as_path).collect();
    let files = &[RESULT, MODEL, REPORT];
    Results { folder: &args.out, files, inputs: &inputs, record, force }.claim()
}
