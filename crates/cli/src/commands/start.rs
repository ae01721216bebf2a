//! `augsim start`: from recordings as they are to a data file and a model file.

use crate::args::Start;
use augsim_data::{
    DataError, Dataset, MissingCells, Reading, Recognised, Recording, Summary, read_dataset, recognise,
    write_dataset,
};
use augsim_physics::ball::seen_floor_m;
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
/// Endings of files that are no text.
const KNOWN: [&str; 4] = ["npz", "h5", "json", "zip"];
/// Height of the floor, m, from which the model names it: a ball's radius is less.
const RAISED_M: f64 = 0.05;

/// Files that were written, with the reading of the recording.
#[derive(Debug, Serialize)]
struct Begun {
    data: PathBuf,
    /// Absent where no model of the library fits the recording.
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
    let Recognised { data, recording, assumed } = read(args)?;
    let floor = match recording {
        Recording::Falls(_) => seen_floor_m(&data),
        _ => None,
    };
    let source: Vec<String> = args.data.iter().map(|p| p.display().to_string()).collect();
    let text = model(recording, floor, &source.join(" "));
    claim.begin()?;
    let data_file = args.out.join(DATA);
    write_dataset(&data, &data_file)?;
    let model = text.map(|text| claim.write(MODEL, &text)).transpose()?;
    let next = next(&recording, &data_file, model.as_deref());
    let begun = Begun {
        data: data_file,
        model,
        recording: word(&recording),
        trajectories: data.trajectories().len(),
        samples: data.trajectories().iter().map(|t| t.len()).sum(),
        assumed,
        floor_height_m: floor,
        next,
    };
    output.result(&begun, || start_text(&begun, &data, &recording))?;
    Ok(Outcome::Done)
}

/// Reads text by recognising it, and published formats as they are.
fn read(args: &Start) -> Result<Recognised, DataError> {
    let known = |path: &Path| path.extension().is_some_and(|e| KNOWN.iter().any(|k| e == *k));
    if let [one] = &args.data[..]
        && known(one)
    {
        let data = read_dataset(one, MissingCells::AsGap)?;
        let recording =
            match (data.has_column("pusher_x_m"), data.has_column("x_m") && data.has_column("z_m")) {
                (true, _) => Recording::Pushes,
                (_, true) => Recording::Falls(if data.has_column("y_m") { 3 } else { 2 }),
                _ if data.has_column("height_m") => Recording::Falls(1),
                _ => Recording::Other,
            };
        return Ok(Recognised { data, recording, assumed: Vec::new() });
    }
    let reading = Reading {
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

fn word(recording: &Recording) -> &'static str {
    match recording {
        Recording::Falls(1) => "drops",
        Recording::Falls(2) => "throws in a plane",
        Recording::Falls(_) => "throws in space",
        Recording::Pushes => "pushes",
        Recording::Moves(_) => "something that moves and does not fall freely",
        Recording::Other => "something else",
    }
}

/// The model to begin with; `None` where the library has none.
fn model(recording: Recording, floor: Option<f64>, source: &str) -> Option<String> {
    let head =
        |text: &str| format!("# Made by augsim start from {}.\n{text}", source.replace(['\n', '\r'], " "));
    match recording {
        Recording::Falls(_) => {
            let mut text = template("ball")?.to_owned();
            let suggested = "# floor_height_m = { nominal = 0.0, min = -0.5, max = 0.5 }";
            match floor {
                // Without impacts there is nothing to calibrate a restitution by.
                None => text = text.replace("\nrestitution = ", "\n# No impacts are seen.\n# restitution = "),
                Some(z) if z.abs() > RAISED_M => {
                    let (low, high) = (z - 0.5, z + 0.5);
                    let line =
                        format!("floor_height_m = {{ nominal = {z:.4}, min = {low:.4}, max = {high:.4} }}");
                    text = text.replace(suggested, &line);
                }
                Some(_) => {}
            }
            Some(head(&text))
        }
        Recording::Pushes => template("push").map(head),
        Recording::Moves(_) | Recording::Other => None,
    }
}

fn next(recording: &Recording, data: &Path, model: Option<&Path>) -> String {
    let words = |list: &[&str]| quoted(&list.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>());
    let data = data.display().to_string();
    match (recording, model) {
        (Recording::Pushes, Some(model)) => {
            let model = model.display().to_string();
            format!(
                "say in {model} which object it is, then {}",
                words(&["augsim", "discover", &model, &data])
            )
        }
        (_, Some(model)) => words(&["augsim", "discover", &model.display().to_string(), &data]),
        (_, None) => format!(
            "write its equations: augsim model new pendulum --out my.toml (docs/model-file.md), then {}",
            words(&["augsim", "discover", "my.toml", &data])
        ),
    }
}

/// Writes what was recognised and what comes next, in at most ten lines.
fn start_text(begun: &Begun, data: &Dataset, recording: &Recording) -> String {
    let mut lines = begun.assumed.clone();
    lines.truncate(5);
    let summary = Summary::of(data);
    let mut what =
        format!("{}: {} trajectories, {} samples", begun.recording, begun.trajectories, begun.samples);
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
    match (recording, begun.floor_height_m) {
        (_, Some(z)) => lines.push(format!("floor at {z:.3} m")),
        (Recording::Falls(_), None) => lines.push("no impacts are seen".to_owned()),
        (Recording::Moves(Some(a)), _) => lines.push(format!(
            "what should fall accelerates by {a:.3} m/s^2: if it is a ball, give units by --columns and up by --up"
        )),
        _ => {}
    }
    if begun.trajectories == 1 {
        lines.push("one trajectory shows nothing that differs between trajectories; record more".to_owned());
    }
    let model = begun.model.as_ref().map_or(String::new(), |m| format!(" and {}", m.display()));
    lines.push(format!("written: {}{model}", begun.data.display()));
    lines.push(format!("next: {}", begun.next));
    lines.join("\n")
}
