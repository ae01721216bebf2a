//! `reproduce robots`: measured arms and a simulated one, with rigid-body models from their description files.
//!
//! Each row has the torque errors of the declared, the calibrated and the augmented model on held-out data, the effects
//! found, and published values beside the found ones.

mod declared;
mod page;
mod published;
mod sets;
mod simulated;

use crate::absent::MissingData;
use crate::args::Reproduce;
use crate::measured::{self, NULL_RUNS, Times, data_folder, discover_set};
use crate::reproduction::{claim, finish, repeat_on_data};
use augsim_data::{atomic_write, write_dataset};
use augsim_session::joints::{JointResult, joint_results};
use augsim_session::robot::model_from_robot;
use augsim_session::{Subject, folders};
use augsim_terminal::Outcome;
use augsim_terminal::destination::REPORT;
use augsim_terminal::discover_args::Discover;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use published::Compared;
use serde::Serialize;
use sets::{SETS, Set};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Name of the data file beside each model file.
const DATA: &str = "data.csv";

/// Content of `result.json` of `reproduce robots`.
type ResultFile = measured::ResultFile<SetRow>;

/// Results on one arm.
#[derive(Debug, Serialize)]
struct SetRow {
    set: &'static str,
    source: &'static str,
    /// Reason why the arm cannot be declared from its files, and then nothing else; absent for a result.
    #[serde(skip_serializing_if = "Option::is_none")]
    left_out: Option<String>,
    /// Result of the discovery; absent if the arm cannot be declared.
    #[serde(skip_serializing_if = "Option::is_none")]
    found: Option<Found>,
    /// Run time, s; kept out of the result, which is the same for every run.
    #[serde(skip)]
    seconds: f64,
}

/// Result of a discovery on one arm.
#[derive(Debug, Serialize)]
struct Found {
    verdict: augsim_discovery::Verdict,
    sentence: String,
    kinds: Vec<String>,
    joints: Vec<JointResult>,
    /// Published or true values, with the found ones.
    compared: Vec<Compared>,
    /// Path of the discovery's report, relative to the results folder.
    report: PathBuf,
}

/// Runs `reproduce robots`.
pub fn run(args: &Reproduce, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let data = data_folder(args, "robots")?;
    let is_there = |set: &&Set| set.folder.is_none_or(|folder| data.join(folder).is_dir());
    if !SETS.iter().any(|set| set.folder.is_some() && is_there(&set)) {
        let sets = SETS.iter().filter_map(|set| set.folder).collect();
        return Err(MissingData::Systems { data: data.to_owned(), sets }.into());
    }
    let out = args.out.clone().unwrap_or_else(|| "out/robots".into());
    let record = Record::new("reproduce robots")
        .setting("seed", seed)
        .setting("quick", args.quick)
        .input("data", data);
    let claim = claim(&out, record, &[data], args.resume, force)?;
    claim.begin()?;
    let mut sets = Vec::new();
    for set in &SETS {
        if !is_there(&set) {
            output.note(format!("{}: not found, skipped", data.join(set.name).display()));
            continue;
        }
        let start = Instant::now();
        let row = one(set, data, &out, (seed, args.quick), output)?;
        sets.push(SetRow { seconds: start.elapsed().as_secs_f64(), ..row });
    }
    let times = Times::new(sets.iter().map(|row| (row.set, row.seconds)));
    let result = ResultFile::new("robots", sets, seed);
    let command = repeat_on_data("robots", args, data, seed);
    let page = |result: &ResultFile| Ok(page::page(result, data, &command).render());
    finish(&claim, &result, page, Some(times), text, output)
}

/// Declares an arm from its files, and finds what the model lacks; a row with the reason if it cannot be declared.
fn one(
    set: &Set,
    data: &Path,
    out: &Path,
    (seed, quick): (u64, bool),
    output: &Output,
) -> anyhow::Result<SetRow> {
    let row = |left_out: Option<String>, found: Option<Found>| SetRow {
        set: set.name,
        source: set.source,
        left_out,
        found,
        seconds: 0.0,
    };
    output.note(format!("{}: reading", set.name));
    let declared = match (set.declare)(&data.join(set.folder.unwrap_or(""))) {
        Ok(declared) => declared,
        Err(reason) => return Ok(row(Some(reason), None)),
    };
    let robot = augsim_robot::read(&declared.description, declared.file)?;
    let made = match model_from_robot(&robot, &declared.log, &declared.request) {
        Ok(made) => made,
        Err(reason) => return Ok(row(Some(reason.to_string()), None)),
    };
    let folder = out.join(set.name);
    folders::make(&folder)?;
    let (model_path, data_path) = (folder.join("declared.toml"), folder.join(DATA));
    atomic_write(&folder.join(declared.file), |w| w.write_all(declared.description.as_bytes()))?;
    atomic_write(&model_path, |w| w.write_all(made.text.as_bytes()))?;
    write_dataset(&made.data, &data_path)?;
    let subject = match Subject::read(&model_path) {
        Ok(subject) => subject,
        Err(reason) => return Ok(row(Some(reason.to_string()), None)),
    };
    let args = Discover {
        model: model_path,
        data: vec![data_path],
        out: folder,
        null_runs: if quick { 0 } else { NULL_RUNS },
        ..Discover::default()
    };
    let found = discover_set(set.name, &args, seed, output)?;
    let joints = joint_results(&subject, &found, Some(&made.data));
    let compared = published::compare(declared.published, &found, &joints);
    Ok(row(
        None,
        Some(Found {
            verdict: found.verdict,
            sentence: found.sentence,
            kinds: found.effects.into_iter().map(|e| e.kind).collect(),
            joints,
            compared,
            report: Path::new(set.name).join(REPORT),
        }),
    ))
}

/// Mean over the joints of an error in % of the standard deviation of the measured values; `None` without joints.
fn mean_percent(joints: &[JointResult], error: fn(&JointResult) -> augsim_discovery::Rmse) -> Option<f64> {
    let percents: Vec<f64> = joints.iter().filter_map(|joint| joint.percent(error(joint))).collect();
    (!percents.is_empty()).then(|| percents.iter().sum::<f64>() / percents.len() as f64)
}

/// The table for people: one line for each set, then its effects and the published values.
fn text(result: &ResultFile) -> String {
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "{:<18}{:>7}{:>10}{:>12}{:>11}{:>9}   error in % of the standard deviation, held out, mean of the joints",
        "set", "joints", "declared", "calibrated", "augmented", "seconds"
    );
    for row in &result.sets {
        let Some(found) = &row.found else {
            let reason = row.left_out.as_deref().unwrap_or("no result");
            let _ = writeln!(out, "{:<18}left out: {reason}", row.set);
            continue;
        };
        let shown = |error: fn(&JointResult) -> augsim_discovery::Rmse| {
            mean_percent(&found.joints, error).map_or("-".to_owned(), |p| format!("{p:.1}"))
        };
        let _ = writeln!(
            out,
            "{:<18}{:>7}{:>10}{:>12}{:>11}{:>9.0}",
            row.set,
            found.joints.len(),
            shown(|j| j.declared),
            shown(|j| j.calibrated),
            shown(|j| j.augmented),
            row.seconds
        );
        let kinds = if found.kinds.is_empty() { "none".to_owned() } else { found.kinds.join(", ") };
        let _ = writeln!(out, "  effects: {kinds}");
        for line in published::lines(&found.compared) {
            let _ = writeln!(out, "  {line}");
        }
        let _ = writeln!(out, "  source: {}", row.source);
    }
    out
}

#[cfg(test)]
mod tests;
