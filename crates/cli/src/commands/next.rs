//! `augsim next` and `augsim listen`: the next experiment, designed and judged.

use super::note_reading;
use crate::args::{Listen, Next};
use augsim_session::DataFrom;
use augsim_session::next::{
    Known, ListenRequest, PlanOptions, State, listen, listen_page, listen_text, plan_page, plan_text,
    recordings,
};
use augsim_terminal::Outcome;
use augsim_terminal::destination::{REPORT, Results};
use augsim_terminal::output::Output;
use augsim_terminal::progress::Steps;
use augsim_terminal::record::Record;
use std::path::{Path, PathBuf};

/// Name of the output file with the plan and the evidence.
const PLAN: &str = "plan.json";

/// Runs `augsim next`: designs the runs that separate the explanations, and promises their odds.
pub fn next(args: &Next, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let known = Known::open(&args.explanations, !args.data.is_empty());
    let is_continued = known.as_ref().is_ok_and(Known::is_continued);
    let paths = match args.data.is_empty() && !is_continued {
        true => recorded_data(&args.explanations)?,
        false => args.data.clone(),
    };
    let mut record = Record::new("next")
        .setting("seed", seed)
        .setting("budget", args.budget)
        .setting("odds", args.odds)
        .setting("sequences", args.sequences)
        .inputs("explanation", &args.explanations)
        .inputs("data", &paths);
    record = args.limits.iter().fold(record, |record, file| record.input("limits", file));
    record = args.time.recorded(record);
    let inputs: Vec<&Path> =
        args.explanations.iter().chain(&paths).chain(&args.limits).map(PathBuf::as_path).collect();
    let names: Vec<String> = (1..=args.budget).map(|k| format!("run-{k}.csv")).collect();
    let files: Vec<&str> = [PLAN, REPORT].into_iter().chain(names.iter().map(String::as_str)).collect();
    let claim = Results { folder: &args.out, files: &files, inputs: &inputs, record, force }.claim()?;
    let mut known = known?;
    if !paths.is_empty() {
        let from = args.time.of_all(&paths);
        note_reading(&from, known.model(), output)?;
        known.read(from, !args.data.is_empty())?;
    }
    let steps = Steps::new(output);
    steps.show_step("designing the runs and simulating their odds".to_owned());
    let options = PlanOptions {
        budget: usize::from(args.budget),
        odds: args.odds,
        sequences: u64::from(args.sequences),
        seed,
    };
    let planned = known.plan(args.limits.as_deref(), options)?;
    steps.finish();
    claim.begin()?;
    claim.write(PLAN, &serde_json::to_string_pretty(&planned.state)?)?;
    for (name, text) in &planned.files {
        claim.write(name, text)?;
    }
    let page = claim.write(REPORT, &plan_page(&planned, seed).render())?;
    claim.write_timing(())?;
    output
        .result(&planned.state, || format!("{}\n\nreport: {}", plan_text(&planned.state), page.display()))?;
    Ok(match planned.state.promise.as_ref().is_some_and(|p| !p.is_enough) {
        true => Outcome::CriterionNotMet,
        false => Outcome::Done,
    })
}

/// Runs `augsim listen`: updates the weights of the explanations by new recordings.
pub fn hear(args: &Listen, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let mut record = Record::new("listen").input("plan", &args.plan).inputs("data", &args.data);
    record = args.time.recorded(record);
    let inputs: Vec<&Path> = [&args.plan].into_iter().chain(&args.data).map(PathBuf::as_path).collect();
    let files = [PLAN, REPORT];
    let claim = Results { folder: &args.out, files: &files, inputs: &inputs, record, force }.claim()?;
    let state = State::read(&args.plan)?;
    let model = state.first_model()?;
    let from: DataFrom = args.time.of_all(&args.data);
    note_reading(&from, &model, output)?;
    let new = recordings(from, &model)?;
    let heard = listen(&ListenRequest { state: &state, records: &new })?;
    claim.begin()?;
    claim.write(PLAN, &serde_json::to_string_pretty(&heard)?)?;
    let page = claim.write(REPORT, &listen_page(&heard).render())?;
    claim.write_timing(())?;
    output.result(&heard, || format!("{}\n\nreport: {}", listen_text(&heard), page.display()))?;
    Ok(if heard.verdict == "enough" { Outcome::Done } else { Outcome::CriterionNotMet })
}

/// Recordings that the folders among the explanations were made from, as far as they still exist.
fn recorded_data(explanations: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut found: Vec<PathBuf> = Vec::new();
    for folder in explanations.iter().filter(|path| path.is_dir()) {
        let Some(record) = Record::read(folder)? else { continue };
        let data = record.paths.iter().filter(|(name, _)| *name == "data" || name.starts_with("data-"));
        let paths = data.map(|(_, path)| folder.join(path)).filter(|path| path.exists());
        paths.for_each(|path| {
            if !found.contains(&path) {
                found.push(path);
            }
        });
    }
    Ok(found)
}
