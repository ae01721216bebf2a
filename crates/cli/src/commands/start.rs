//! `augsim start`: converts raw recordings into a data file and a starting model file.

use crate::args::Start;
use augsim_data::{Dataset, RecognitionOptions, RecordingKind, Summary, escaped_list, write_dataset};
use augsim_session::command_line::quoted;
use augsim_session::start::{Started, from_files};
use augsim_session::usage::Takes;
use augsim_terminal::destination::Results;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use augsim_terminal::{Outcome, Usage};
use serde::Serialize;
use std::path::{Path, PathBuf};

const DATA: &str = "data.csv";
const MODEL: &str = "model.toml";

/// Output of `augsim start`: the written files and how the recording was interpreted.
#[derive(Debug, Serialize)]
struct StartResult {
    data: PathBuf,
    /// Path of the model file; absent if no column varies, so that there is nothing to model.
    model: Option<PathBuf>,
    recording: &'static str,
    trajectories: usize,
    samples: usize,
    assumed: Vec<String>,
    floor_height_m: Option<f64>,
    /// Names of the columns that the drafted equations take as inputs.
    inputs: Vec<String>,
    /// Names of the columns that the drafted equations take as outputs.
    outputs: Vec<String>,
    next: String,
}

/// Runs `augsim start`: converts raw recordings into a data file and a starting model file.
pub fn run(args: &Start, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    if let Some(rate) = args.rate_hz.filter(|rate| !(*rate > 0.0 && rate.is_finite())) {
        return Err(Usage::option("--rate-hz", rate, Takes::Positive).into());
    }
    let mut record = Record::new("start")
        .setting("time", args.time.as_deref().unwrap_or("as found"))
        .setting("trajectory", args.trajectory.as_deref().unwrap_or("as found"))
        .setting("columns", args.columns.iter().map(ToString::to_string).collect::<Vec<_>>().join(","))
        .setting("up", args.up.as_deref().unwrap_or("as found"))
        .setting("sep", args.sep.map_or("as found".to_owned(), |c| c.to_string()))
        .setting("decimal", args.decimal.as_deref().unwrap_or("as found"))
        .setting("rate-hz", args.rate_hz.map_or("as found".to_owned(), |r| r.to_string()));
    for (i, path) in args.data.iter().enumerate() {
        record = record.input(&format!("data-{}", i + 1), path);
    }
    let inputs: Vec<&Path> = args.data.iter().map(PathBuf::as_path).collect();
    let claim =
        Results { folder: &args.out, files: &[DATA, MODEL], inputs: &inputs, record, force }.claim()?;
    let started = from_files(&args.data, &layout(args))?;
    claim.begin()?;
    let data_file = args.out.join(DATA);
    let Started { data, model, recording, assumptions, floor_height_m, drafted } = started;
    write_dataset(&data, &data_file)?;
    let model = model.map(|text| claim.write(MODEL, &text)).transpose()?;
    let next = next(recording, &data_file, model.as_deref(), drafted.is_some());
    let (inputs, outputs) = drafted.map_or_else(Default::default, |d| (d.inputs, d.outputs));
    let result = StartResult {
        data: data_file,
        model,
        recording: recording.name(),
        trajectories: data.trajectories().len(),
        samples: data.trajectories().iter().map(|t| t.len()).sum(),
        assumed: assumptions,
        floor_height_m,
        inputs,
        outputs,
        next,
    };
    output.result(&result, || start_text(&result, &data, recording))?;
    Ok(Outcome::Done)
}

/// Layout of the recordings that the options state.
fn layout(args: &Start) -> RecognitionOptions {
    RecognitionOptions {
        separator: args.sep,
        decimal: args.decimal.as_ref().and_then(|d| d.chars().next()),
        time: args.time.clone(),
        trajectory: args.trajectory.clone(),
        columns: args.columns.clone(),
        up: args.up.clone(),
        rate_hz: args.rate_hz,
    }
}

/// Text with the commands to run next; `is_draft` states that the model is a draft of equations.
fn next(recording: RecordingKind, data: &Path, model: Option<&Path>, is_draft: bool) -> String {
    let words = |list: &[&str]| quoted(&list.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>());
    let data = data.display().to_string();
    let Some(model) = model.map(|m| m.display().to_string()) else {
        return "no column varies, so there is nothing to model; check the columns with --columns".to_owned();
    };
    let command = |name: &str| words(&["augsim", name, &model, &data]);
    match recording {
        _ if is_draft => {
            format!("fill in the equations in {model}, then\n  {}\n  {}", command("fit"), command("discover"))
        }
        RecordingKind::Pushes => format!("set the object in {model}, then {}", command("discover")),
        _ => command("discover"),
    }
}

/// Formats the interpretation of the recording and the next command in at most ten lines.
fn start_text(result: &StartResult, data: &Dataset, recording: RecordingKind) -> String {
    let mut lines = result.assumed.clone();
    // Ten lines in all.
    lines.truncate(if result.outputs.is_empty() { 5 } else { 3 });
    let summary = Summary::from_dataset(data);
    let mut what =
        format!("{}: {} trajectories, {} samples", result.recording, result.trajectories, result.samples);
    if let Some(s) = summary.sampling {
        what += &format!(" at {:.2} Hz", s.median_rate_hz);
        if !s.regular {
            what += ", irregular";
        }
        if s.gaps > 0 {
            what += &format!(", {} gaps up to {:.3} s", s.gaps, s.longest_interval_s);
        }
    }
    let blank: usize = summary.columns.iter().map(|c| c.missing).sum();
    if blank > 0 {
        what += &format!(", {blank} empty cells");
    }
    lines.push(what);
    match (recording, result.floor_height_m) {
        (_, Some(z)) => lines.push(format!("floor at {z:.3} m")),
        (RecordingKind::Falls(_), None) => lines.push("no impacts were found".to_owned()),
        (RecordingKind::Moves(Some(a)), _) => lines.push(format!(
            "the vertical acceleration is {a:.3} m/s^2, not that of gravity: for a ball, give the units with --columns and the direction with --up"
        )),
        _ => {}
    }
    if result.trajectories == 1 {
        lines.push(
            "differences between trajectories cannot be estimated from one trajectory; record more"
                .to_owned(),
        );
    }
    if !result.outputs.is_empty() {
        let inputs = if result.inputs.is_empty() { "none".to_owned() } else { escaped_list(&result.inputs) };
        lines.push(format!("drafted: inputs {inputs}; outputs {}", escaped_list(&result.outputs)));
    }
    let joints = augsim_session::robot::joints_in_log(data.columns());
    if joints >= 2 {
        lines.push(format!(
            "these look like {joints} joints of a robot: with its URDF or MJCF file, augsim model from-robot ROBOT.urdf {} makes a model of its dynamics",
            result.data.display()
        ));
    }
    let model = result.model.as_ref().map_or(String::new(), |m| format!(" and {}", m.display()));
    lines.push(format!("written: {}{model}", result.data.display()));
    lines.push(format!("next: {}", result.next));
    lines.join("\n")
}
