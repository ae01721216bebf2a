//! `augsim model from-robot`: writes a model file and its data from a robot's description and a log of its joints.

use crate::args::{FormulationArg, FreeArg, FromRobot};
use anyhow::Context;
use augsim_data::{
    DataError, MissingCells, RecognitionOptions, digits, escaped_list, recognise, write_dataset,
};
use augsim_robot::MAX_FILE_BYTES;
use augsim_session::Usage;
use augsim_session::command_line::quoted;
use augsim_session::robot::{Formulation, Free, RobotModel, RobotRequest, model_from_robot};
use augsim_session::usage::PathFault;
use augsim_terminal::Outcome;
use augsim_terminal::destination::Results;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use serde::Serialize;
use std::path::{Path, PathBuf};

const DATA: &str = "data.csv";
const MODEL: &str = "model.toml";

/// Output of `augsim model from-robot`.
#[derive(Debug, Serialize)]
struct FromRobotResult {
    model: PathBuf,
    data: PathBuf,
    robot: PathBuf,
    formulation: &'static str,
    joints: Vec<String>,
    trajectories: usize,
    samples: usize,
    /// Cutoff frequency of the low-pass filter; absent in the forward formulation.
    cutoff_hz: Option<f64>,
    /// Sample rate of the filtered data; absent in the forward formulation.
    rate_hz: Option<f64>,
    /// Parameters of the robot that a fit may change.
    free: Vec<String>,
    notes: Vec<String>,
    next: String,
}

/// Runs `augsim model from-robot`.
pub fn run(args: &FromRobot, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let file = args.robot.file_name().map(|name| name.to_string_lossy().into_owned());
    let file = file.ok_or_else(|| is_a_folder(&args.robot))?;
    if file == MODEL || file == DATA {
        return Err(Usage::path(&args.robot, PathFault::OtherModel).into());
    }
    let inputs: Vec<&Path> =
        std::iter::once(args.robot.as_path()).chain(args.data.iter().map(PathBuf::as_path)).collect();
    let claim = Results {
        folder: &args.out,
        files: &[DATA, MODEL, &file],
        inputs: &inputs,
        record: record(args),
        force,
    }
    .claim()?;
    let text = description(&args.robot)?;
    let shown = args.robot.display().to_string();
    let robot = augsim_robot::read(&text, &shown)?;
    let reading = RecognitionOptions {
        time: args.time.clone(),
        columns: args.columns.clone(),
        ..RecognitionOptions::default()
    };
    let log = recognise(&args.data, &reading, MissingCells::AsGap)?;
    let request = request(args, &file);
    let made = model_from_robot(&robot, &log.data, &request)?;
    // What was written is read again, so that no model is written that the other commands refuse.
    claim.begin()?;
    let robot_file = claim.write(&file, &text)?;
    let model_file = claim.write(MODEL, &made.text)?;
    augsim_equations::model::read(&model_file).context("the model that was made is not valid")?;
    let data_file = args.out.join(DATA);
    write_dataset(&made.data, &data_file)?;
    let result = result(&made, [&model_file, &data_file, &robot_file]);
    output.result(&result, || text_of(&result))?;
    Ok(Outcome::Done)
}

/// The error that a path of a description is a folder.
fn is_a_folder(path: &Path) -> DataError {
    let cause = std::io::Error::other("it is a folder, and not a URDF or MJCF file");
    DataError::Unreadable { path: path.to_path_buf(), cause }
}

/// Reads the description file.
fn description(path: &Path) -> anyhow::Result<String> {
    let unreadable = |cause| DataError::Unreadable { path: path.to_path_buf(), cause };
    let about = std::fs::metadata(path).map_err(unreadable)?;
    if about.is_dir() {
        return Err(is_a_folder(path).into());
    }
    if about.len() > MAX_FILE_BYTES as u64 {
        let text = format!("{} bytes, but at most {MAX_FILE_BYTES} are allowed", about.len());
        return Err(unreadable(std::io::Error::other(text)).into());
    }
    Ok(std::fs::read_to_string(path).map_err(unreadable)?)
}

/// The settings and inputs that determine the result.
fn record(args: &FromRobot) -> Record {
    let pairs = |list: &[(String, String)]| -> String {
        list.iter().map(|(joint, text)| format!("{joint}={text}")).collect::<Vec<_>>().join("; ")
    };
    let mut record = Record::new("model from-robot")
        .setting("joints", args.joints.join(","))
        .setting("position", pairs(&args.position))
        .setting("torque", pairs(&args.torque))
        .setting("formulation", args.formulation.map_or("as found".to_owned(), |f| format!("{f:?}")))
        .setting("gravity", format!("{:?}", args.gravity))
        .setting("free", format!("{:?}", args.free))
        .setting("time", args.time.as_deref().unwrap_or("as found"))
        .setting("columns", args.columns.iter().map(ToString::to_string).collect::<Vec<_>>().join(","))
        .input("robot", &args.robot);
    for (i, path) in args.data.iter().enumerate() {
        record = record.input(&format!("data-{}", i + 1), path);
    }
    record
}

fn request(args: &FromRobot, file: &str) -> RobotRequest {
    let frees = |group: FreeArg| args.free.contains(&group);
    let log: Vec<String> = args.data.iter().map(|p| p.display().to_string()).collect();
    RobotRequest {
        joints: args.joints.clone(),
        positions: args.position.clone(),
        torques: args.torque.clone(),
        formulation: args.formulation.map(|formulation| match formulation {
            FormulationArg::Inverse => Formulation::Inverse,
            FormulationArg::Forward => Formulation::Forward,
        }),
        gravity: args.gravity,
        free: Free {
            inertias: frees(FreeArg::Inertias),
            armature: frees(FreeArg::Armature),
            viscous: frees(FreeArg::Viscous),
        },
        file: file.to_owned(),
        log: log.join(" "),
    }
}

fn result(made: &RobotModel, [model, data, robot]: [&PathBuf; 3]) -> FromRobotResult {
    let words = [model, data].map(|path| path.display().to_string());
    let command: Vec<String> =
        ["augsim".to_owned(), "discover".to_owned()].into_iter().chain(words).collect();
    FromRobotResult {
        model: model.clone(),
        data: data.clone(),
        robot: robot.clone(),
        formulation: match made.formulation {
            Formulation::Inverse => "inverse",
            Formulation::Forward => "forward",
        },
        joints: made.joints.clone(),
        trajectories: made.data.trajectories().len(),
        samples: made.data.trajectories().iter().map(|t| t.len()).sum(),
        cutoff_hz: made.preparation.as_ref().map(|p| p.cutoff_hz),
        rate_hz: made.preparation.as_ref().map(|p| p.rate_hz),
        free: made.free.clone(),
        notes: made.notes.clone(),
        next: quoted(&command),
    }
}

fn text_of(result: &FromRobotResult) -> String {
    let mut lines = vec![format!(
        "{} joints ({}), {} trajectories, {} samples",
        result.joints.len(),
        escaped_list(&result.joints),
        result.trajectories,
        result.samples
    )];
    lines.push(match (result.cutoff_hz, result.rate_hz) {
        (Some(cutoff), Some(rate)) => format!(
            "inverse dynamics: motion in, torque out; low-pass filter at {} Hz, {} samples per second",
            digits(cutoff),
            digits(rate)
        ),
        _ => "forward dynamics: torques or commands in, motion out".to_owned(),
    });
    if !result.free.is_empty() {
        lines.push(format!("free: {}", escaped_list(&result.free)));
    }
    lines.extend(result.notes.iter().map(|note| format!("note: {note}")));
    let [model, data, robot] = [&result.model, &result.data, &result.robot].map(|path| path.display());
    lines.push(format!("written: {model}, {data} and {robot}"));
    lines.push(format!("next: {}", result.next));
    lines.join("\n")
}
