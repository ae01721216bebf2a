//! `augsim start`: converts raw recordings into a data file and a starting model file.

use crate::args::Start;
use augsim_data::{
    DataError, Dataset, MissingCells, RecognisedData, RecognitionOptions, RecordingKind, Summary,
    read_dataset, recognise, write_dataset,
};
use augsim_physics::ball::detected_floor_m;
use augsim_physics::model::template;
use augsim_session::command_line::quoted;
use augsim_session::usage::Takes;
use augsim_terminal::destination::Results;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use augsim_terminal::{Outcome, Usage};
use serde::Serialize;
use std::path::{Path, PathBuf};

const DATA: &str = "data.csv";
const MODEL: &str = "model.toml";
/// Endings of published data formats, which are not read as text.
const BINARY_ENDINGS: [&str; 4] = ["npz", "h5", "json", "zip"];
/// Floor height in m above which the model declares it, larger than the radius of a ball.
const MIN_DECLARED_FLOOR_M: f64 = 0.05;

/// Files that were written and how the recording was interpreted.
#[derive(Debug, Serialize)]
struct StartResult {
    data: PathBuf,
    /// Absent if no built-in model fits the recording.
    model: Option<PathBuf>,
    recording: &'static str,
    trajectories: usize,
    samples: usize,
    assumed: Vec<String>,
    floor_height_m: Option<f64>,
    next: String,
}

/// Runs the subcommand.
pub fn run(args: &Start, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    if let Some(rate) = args.rate_hz.filter(|rate| !(*rate > 0.0 && rate.is_finite())) {
        return Err(Usage::option("--rate-hz", rate, Takes::Positive).into());
    }
    let mut record = Record::new("start")
        .setting("time", args.time.as_deref().unwrap_or("as found"))
        .setting("trajectory", args.trajectory.as_deref().unwrap_or("as found"))
        .setting("columns", format!("{:?}", args.columns))
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
    let RecognisedData { data, recording, assumptions: assumed } = read(args)?;
    let floor = match recording {
        RecordingKind::Falls(_) => detected_floor_m(&data),
        _ => None,
    };
    let source: Vec<String> = args.data.iter().map(|p| p.display().to_string()).collect();
    let text = model(recording, floor, &source.join(" "));
    claim.begin()?;
    let data_file = args.out.join(DATA);
    write_dataset(&data, &data_file)?;
    let model = text.map(|text| claim.write(MODEL, &text)).transpose()?;
    let next = next(&recording, &data_file, model.as_deref());
    let result = StartResult {
        data: data_file,
        model,
        recording: word(&recording),
        trajectories: data.trajectories().len(),
        samples: data.trajectories().iter().map(|t| t.len()).sum(),
        assumed,
        floor_height_m: floor,
        next,
    };
    output.result(&result, || start_text(&result, &data, &recording))?;
    Ok(Outcome::Done)
}

/// Reads published formats directly and recognises the layout of text files.
fn read(args: &Start) -> Result<RecognisedData, DataError> {
    let is_binary = |path: &Path| path.extension().is_some_and(|e| BINARY_ENDINGS.iter().any(|k| e == *k));
    if let [one] = &args.data[..]
        && is_binary(one)
    {
        let data = read_dataset(one, MissingCells::AsGap)?;
        let recording =
            match (data.has_column("pusher_x_m"), data.has_column("x_m") && data.has_column("z_m")) {
                (true, _) => RecordingKind::Pushes,
                (_, true) => RecordingKind::Falls(if data.has_column("y_m") { 3 } else { 2 }),
                _ if data.has_column("height_m") => RecordingKind::Falls(1),
                _ => RecordingKind::Other,
            };
        return Ok(RecognisedData { data, recording, assumptions: Vec::new() });
    }
    let reading = RecognitionOptions {
        separator: args.sep,
        decimal: args.decimal.as_ref().and_then(|d| d.chars().next()),
        time: args.time.clone(),
        trajectory: args.trajectory.clone(),
        columns: args.columns.clone(),
        up: args.up.clone(),
        rate_hz: args.rate_hz,
    };
    recognise(&args.data, &reading, MissingCells::AsGap)
}

fn word(recording: &RecordingKind) -> &'static str {
    match recording {
        RecordingKind::Falls(1) => "drops",
        RecordingKind::Falls(2) => "throws in a plane",
        RecordingKind::Falls(_) => "throws in space",
        RecordingKind::Pushes => "pushes",
        RecordingKind::Moves(_) => "a motion without free fall",
        RecordingKind::Other => "other data",
    }
}

/// Returns the starting model file; `None` if no built-in model fits.
fn model(recording: RecordingKind, floor: Option<f64>, source: &str) -> Option<String> {
    let head =
        |text: &str| format!("# Made by augsim start from {}.\n{text}", source.replace(['\n', '\r'], " "));
    match recording {
        RecordingKind::Falls(_) => {
            let mut text = template("ball")?.to_owned();
            let suggested = "# floor_height_m = { nominal = 0.0, min = -0.5, max = 0.5 }";
            match floor {
                // The restitution cannot be calibrated without impacts.
                None => {
                    text = text.replace("\nrestitution = ", "\n# No impacts were found.\n# restitution = ")
                }
                Some(z) if z.abs() > MIN_DECLARED_FLOOR_M => {
                    let (low, high) = (z - 0.5, z + 0.5);
                    let line =
                        format!("floor_height_m = {{ nominal = {z:.4}, min = {low:.4}, max = {high:.4} }}");
                    text = text.replace(suggested, &line);
                }
                Some(_) => {}
            }
            Some(head(&text))
        }
        RecordingKind::Pushes => template("push").map(head),
        RecordingKind::Moves(_) | RecordingKind::Other => None,
    }
}

fn next(recording: &RecordingKind, data: &Path, model: Option<&Path>) -> String {
    let words = |list: &[&str]| quoted(&list.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>());
    let data = data.display().to_string();
    match (recording, model) {
        (RecordingKind::Pushes, Some(model)) => {
            let model = model.display().to_string();
            format!("set the object in {model}, then {}", words(&["augsim", "discover", &model, &data]))
        }
        (_, Some(model)) => words(&["augsim", "discover", &model.display().to_string(), &data]),
        (_, None) => format!(
            "write a model of equations: augsim model new pendulum --out my.toml (docs/model-file.md), then {}",
            words(&["augsim", "discover", "my.toml", &data])
        ),
    }
}

/// Formats the interpretation of the recording and the next command in at most ten lines.
fn start_text(result: &StartResult, data: &Dataset, recording: &RecordingKind) -> String {
    let mut lines = result.assumed.clone();
    lines.truncate(5);
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
    let model = result.model.as_ref().map_or(String::new(), |m| format!(" and {}", m.display()));
    lines.push(format!("written: {}{model}", result.data.display()));
    lines.push(format!("next: {}", result.next));
    lines.join("\n")
}
