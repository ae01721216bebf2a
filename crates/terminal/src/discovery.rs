//! Runs a discovery from the command line: progress on the terminal and result files in a folder.

use crate::destination::{Claim, REPORT, RESULT, Results};
use crate::discover_args::{Discover, Library};
use crate::interrupt;
use crate::output::Output;
use crate::progress::Steps;
use crate::record::Record;
use crate::time_limit::TimeLimit;
use crate::watched::{Report, Stop, Watched, run_watched};
use augsim_data::Dataset;
use augsim_discovery::{AllowedEffects, Discovery, Observer, Options, Progress};
use augsim_session::discovery_page::page;
use augsim_session::equations::figures::figures;
use augsim_session::equations::fit::OutOfTime;
use augsim_session::joints::ResultFile;
use augsim_session::robot::DescriptionCopy;
use augsim_session::{DiscoverRequest, Discovered, OpenData, ReportContext, Subject, discover_in};
use std::path::{Path, PathBuf};
use std::sync::mpsc::Sender;
use std::time::Instant;

/// Name of the file with the augmented model.
const MODEL: &str = "model.toml";

/// Result of a discovery, and the reason if it was stopped before its end.
#[derive(Debug)]
pub struct Ended {
    /// Result of the discovery; if stopped, the best result so far.
    pub found: Discovery,
    /// Reason why the discovery was stopped early; `None` if it came to its end.
    pub stop: Option<Stop>,
}

/// Runs the discovery and writes `result.json`, `model.toml` and `report.html` to a folder.
///
/// `force` replaces the results of another run in the folder. At the time limit, or at a signal, the best
/// result so far is written.
pub fn run_discovery(args: &Discover, seed: u64, force: bool, output: &Output) -> anyhow::Result<Ended> {
    run(args, seed, force, output, true)
}

/// Runs a discovery as [`run_discovery`], but a signal ends the process without a result.
pub fn run_whole_discovery(
    args: &Discover,
    seed: u64,
    force: bool,
    output: &Output,
) -> anyhow::Result<Discovery> {
    Ok(run(args, seed, force, output, false)?.found)
}

fn run(
    args: &Discover,
    seed: u64,
    force: bool,
    output: &Output,
    takes_interim: bool,
) -> anyhow::Result<Ended> {
    let start_time = Instant::now();
    // Before the claim, so that a file that is no model is not reported as the input of another run.
    let subject = Subject::read(&args.model)?;
    let description = DescriptionCopy::new(&subject, &args.out);
    let claim = claim(args, description.as_ref(), seed, force)?;
    let accept = args.accept.accept.clone();
    let accepted = accept.iter().copied().collect();
    let library = args.library == Library::Generic;
    let limit = TimeLimit::from_now(args.time_limit)?;
    let until = limit.map(|limit| limit.search);
    let effects = AllowedEffects { only: args.effects.only.clone(), exclude: args.effects.exclude.clone() };
    let options = Options { seed, null_runs: args.null_runs, accepted, library, effects, until };
    let request = DiscoverRequest { groups: args.group.clone(), accept, options };
    let data = args.time.of_all(&args.data);
    // Before the search, so that one that fails on a wrong unit still says which unit was taken.
    let open_data = OpenData::open(&subject, &data)?;
    let reading = open_data.reading(&subject).join("; ");
    if !reading.is_empty() {
        output.note(format!("{data}: {reading}"));
    }
    let steps = Steps::new(output);
    let mut show = |p: Progress| steps.show_part(p.describe(), p.fraction());
    let (own_subject, own_request) = (subject.clone(), request.clone());
    let work = move |reports: &Sender<Report<Progress, BestSoFar>>| {
        let mut relay = Relay { reports, takes_interim };
        let Discovered { found, data } = discover_in(&own_subject, open_data, &own_request, &mut relay)?;
        Ok(BestSoFar::Found(Box::new(found), Some(data)))
    };
    let Watched { result, stop } = run_watched(limit.map(|limit| limit.end), &mut show, work)?;
    steps.finish();
    let (mut found, read) = match result {
        Some(BestSoFar::Found(found, read)) => (*found, read),
        Some(BestSoFar::Calibrated(model)) => {
            return Err(write_calibrated(&claim, &model, description.as_ref(), stop)?);
        }
        None => return Err(OutOfTime { calibrated: None }.into()),
    };
    if let Some(stop) = stop {
        found.mark_stopped(stop.cause(), start_time.elapsed().as_secs_f64());
    }
    output.warn(&found.warnings);
    let is_new = |note: &&String| reading.is_empty() || !note.contains(&reading);
    found.notes.iter().filter(is_new).for_each(|note| output.note(note));

    claim.begin()?;
    if let Some(copy) = &description {
        copy.refer_in(&mut found)?;
    }
    let result = ResultFile::new(&subject, &found, read.as_ref());
    claim.write(RESULT, &serde_json::to_string_pretty(&result)?)?;
    let model = claim.write_model(MODEL, &found.model_toml, description.as_ref())?;
    let mut context = ReportContext::new(Some(&args.model), &data, &request, &args.out, &|path| {
        claim.record().fingerprint_of(path)
    });
    if let Some(read) = read.filter(|_| stop.is_none()) {
        // These figures take simulations, for which a stopped run has no time.
        // The models of a robot now name the description in the output folder.
        let declared = match &description {
            Some(_) => Subject::parse(&found.models.declared_toml, &model.display().to_string())?,
            None => subject.clone(),
        };
        context.figures = figures(&declared, &found, &read);
    }
    claim.write(REPORT, &page(&context, &subject, &found).render())?;
    claim.write_timing(())?;
    Ok(Ended { found, stop })
}

/// Writes the calibrated model of a discovery stopped before it had a result; returns the error to report.
fn write_calibrated(
    claim: &Claim,
    model: &str,
    description: Option<&DescriptionCopy>,
    stop: Option<Stop>,
) -> anyhow::Result<anyhow::Error> {
    claim.begin()?;
    let file = claim.write_model(MODEL, model, description)?;
    if stop == Some(Stop::Signal) {
        interrupt::end_with_note(&format!("the calibrated model was written to {}", file.display()));
    }
    Ok(OutOfTime { calibrated: Some(file) }.into())
}

/// Best result of a discovery so far.
enum BestSoFar {
    /// Text of a model file with calibrated values; no result yet.
    Calibrated(String),
    /// A result. It comes with the data of the discovery if the discovery came to its end.
    Found(Box<Discovery>, Option<Dataset>),
}

/// Sends the reports of a discovery to the thread that waits for it.
struct Relay<'a> {
    reports: &'a Sender<Report<Progress, BestSoFar>>,
    takes_interim: bool,
}

impl Observer for Relay<'_> {
    fn report(&mut self, progress: Progress) {
        // The receiver is gone if the discovery was left.
        let _ = self.reports.send(Report::Progress(progress));
    }

    fn takes_interim(&self) -> bool {
        self.takes_interim
    }

    fn interim(&mut self, best_so_far: Discovery) {
        let _ = self.reports.send(Report::Interim(BestSoFar::Found(Box::new(best_so_far), None)));
    }

    fn calibrated(&mut self, model_toml: String) {
        let _ = self.reports.send(Report::Interim(BestSoFar::Calibrated(model_toml)));
    }
}

/// Locks the results folder for a discovery with these settings and inputs.
fn claim(
    args: &Discover,
    description: Option<&DescriptionCopy>,
    seed: u64,
    force: bool,
) -> anyhow::Result<Claim> {
    let record = Record::new("discover")
        .setting("seed", seed)
        .setting("null-runs", args.null_runs)
        .setting("library", args.library.word())
        .setting("group", args.group.join(", "))
        .setting("accept", args.accept.accept.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "))
        .input("model", &args.model)
        .inputs("data", &args.data);
    let record = args.time.recorded(record);
    let record = match args.time_limit {
        Some(seconds) => record.setting("time-limit", seconds),
        None => record,
    };
    let lists = [("only", &args.effects.only), ("exclude", &args.effects.exclude)];
    let record = lists
        .into_iter()
        .filter(|(_, names)| !names.is_empty())
        .fold(record, |record, (name, names)| record.setting(name, names.join(",")));
    let record = description.iter().fold(record, |record, copy| record.input("robot", &copy.source));
    let mut inputs: Vec<&Path> = [&args.model].into_iter().chain(&args.data).map(PathBuf::as_path).collect();
    inputs.extend(description.map(|copy| copy.source.as_path()));
    let mut files = vec![RESULT, MODEL, REPORT];
    files.extend(description.filter(|copy| !copy.is_in_place).map(|copy| copy.name.as_str()));
    Results { folder: &args.out, files: &files, inputs: &inputs, record, force }.claim()
}
