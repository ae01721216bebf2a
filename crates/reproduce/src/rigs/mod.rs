//! `reproduce rigs`: measured rigs with several units, repeated runs or hidden states, with textbook models.
//!
//! Each row has the verdict and the effects that were found, the errors of the declared, the calibrated and the augmented model
//! on recordings that no fit has seen, and the scatter of repeated runs where inputs are repeated.

mod page;
mod sets;

use crate::absent::MissingData;
use crate::args::Reproduce;
use crate::measured::{self, NULL_RUNS, Times, data_folder, discover_set};
use crate::reproduction::{claim, finish, repeat_on_data};
use anyhow::Context;
use augsim_data::{Dataset, atomic_write, with_significant, write_dataset};
use augsim_discovery::{Discovery, ErrorTable, Verdict};
use augsim_equations::{Model, model};
use augsim_session::equations::fit::fit;
use augsim_session::equations::forecast::{Row, free_runs, rows};
use augsim_session::equations::records::{read, records};
use augsim_session::{DataFrom, equations, folders};
use augsim_terminal::Outcome;
use augsim_terminal::destination::REPORT;
use augsim_terminal::discover_args::Discover;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use serde::Serialize;
use sets::{SETS, Set};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Content of `result.json` of `reproduce rigs`.
type ResultFile = measured::ResultFile<SetRow>;

/// Results on one rig.
#[derive(Debug, Serialize)]
struct SetRow {
    set: &'static str,
    source: &'static str,
    lacks: &'static str,
    verdict: Verdict,
    sentence: String,
    kinds: Vec<String>,
    /// Errors by output.
    errors: Vec<Errors>,
    /// Path of the discovery's report, relative to the results folder.
    report: PathBuf,
    /// Run time, s; kept out of the result, which is the same for every run.
    #[serde(skip)]
    seconds: f64,
}

/// Root mean square errors of an output: free runs over held-out recordings, or, without such, forecasts of left-out parts of
/// the recordings.
#[derive(Debug, Serialize)]
struct Errors {
    output: String,
    unit: String,
    /// Whether the errors are those of free runs over held-out recordings.
    held_out_recordings: bool,
    /// Error of the model as declared; `None` if a run diverges. So for the others.
    declared: Option<f64>,
    calibrated: Option<f64>,
    augmented: Option<f64>,
    /// Scatter of the augmented model's errors between fitted runs with the same input, which no model predicts; absent where no
    /// input is repeated.
    #[serde(skip_serializing_if = "Option::is_none")]
    repeats: Option<f64>,
}

/// Runs `reproduce rigs`.
pub fn run(args: &Reproduce, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let data = data_folder(args, "rigs")?;
    let (there, absent): (Vec<&Set>, Vec<&Set>) = SETS.iter().partition(|set| data.join(set.name).is_dir());
    if there.is_empty() {
        let sets = SETS.map(|set| set.name).to_vec();
        return Err(MissingData::Systems { data: data.to_owned(), sets }.into());
    }
    let out = args.out.clone().unwrap_or_else(|| "out/rigs".into());
    let record =
        Record::new("reproduce rigs").setting("seed", seed).setting("quick", args.quick).input("data", data);
    let claim = claim(&out, record, &[data], args.resume, force)?;
    claim.begin()?;
    for set in absent {
        output.note(format!("{}: not found, skipped", data.join(set.name).display()));
    }
    let mut sets = Vec::new();
    for set in there {
        let start = Instant::now();
        let row = one(set, data, &out, (seed, args.quick), output)?;
        sets.push(SetRow { seconds: start.elapsed().as_secs_f64(), ..row });
    }
    let times = Times::new(sets.iter().map(|row| (row.set, row.seconds)));
    let result = ResultFile::new("rigs", sets, seed);
    let command = repeat_on_data("rigs", args, data, seed);
    let page = |result: &ResultFile| Ok(page::page(result, data, &command).render());
    finish(&claim, &result, page, Some(times), text, output)
}

/// Finds what the declared model of a rig lacks, and scores the models.
fn one(
    set: &Set,
    data: &Path,
    out: &Path,
    (seed, quick): (u64, bool),
    output: &Output,
) -> anyhow::Result<SetRow> {
    output.note(format!("{}: reading", set.name));
    let folder = out.join(set.name);
    folders::make(&folder)?;
    let (model_path, data_path) = (folder.join("declared.toml"), folder.join("data.csv.gz"));
    atomic_write(&model_path, |w| w.write_all(set.model.as_bytes()))?;
    let declared = equations::read(&model_path)?;
    let path = data.join(set.name).join("data.csv.gz");
    let all = read(DataFrom::with_time(&path, None).with_groups(set.groups), &declared)?.data;
    let (held_out, fitted): (Vec<usize>, Vec<usize>) =
        (0..all.trajectories().len()).partition(|i| set.is_held_out(all.trajectories()[*i].id()));
    let fitted = all.select(&fitted);
    write_dataset(&fitted, &data_path)?;
    let args = Discover {
        model: model_path,
        data: vec![data_path],
        out: folder.clone(),
        null_runs: if quick { 0 } else { NULL_RUNS },
        ..Discover::default()
    };
    let found = discover_set(set.name, &args, seed, output)?;
    let errors = if held_out.is_empty() {
        of_left_out_parts(&found)
    } else {
        let calibrated = fit(&declared, &records(&fitted, &declared, true)?, None)?.model;
        let augmented_path = folder.join("model.toml");
        let augmented =
            equations::read(&augmented_path).with_context(|| augmented_path.display().to_string())?;
        let models = [declared, calibrated, augmented];
        of_held_out_recordings(&models, &all.select(&held_out), set.burn_in, &found)
    };
    Ok(SetRow {
        set: set.name,
        source: set.source,
        lacks: set.lacks,
        verdict: found.verdict,
        sentence: found.sentence,
        kinds: found.effects.into_iter().map(|e| e.kind).collect(),
        errors,
        report: Path::new(set.name).join(REPORT),
        seconds: 0.0,
    })
}

/// Errors of the forecasts of left-out parts of the recordings, as the discovery measured them.
fn of_left_out_parts(found: &Discovery) -> Vec<Errors> {
    let tables: Vec<&ErrorTable> =
        if found.errors.is_empty() { vec![&found.error] } else { found.errors.values().collect() };
    let row = |table: &ErrorTable| Errors {
        output: table.measure.clone(),
        unit: table.unit.clone(),
        held_out_recordings: false,
        declared: Some(table.declared.rmse),
        calibrated: Some(table.calibrated.rmse),
        augmented: Some(table.augmented.rmse),
        repeats: repeats(found, &table.measure),
    };
    tables.into_iter().map(row).collect()
}

/// Errors of free runs over held-out recordings, by the declared, the calibrated and the augmented model.
fn of_held_out_recordings(
    models: &[Model; 3],
    held_out: &Dataset,
    burn_in: usize,
    found: &Discovery,
) -> Vec<Errors> {
    let scores = models.each_ref().map(|model| scores(model, held_out, burn_in));
    let row = |(index, output): (usize, &model::Output)| {
        let error = |k: usize| scores[k].get(index).map(|row| row.rmse).filter(|e| e.is_finite());
        Errors {
            output: output.name.clone(),
            unit: output.unit.map_or_else(String::new, |unit| unit.to_string()),
            held_out_recordings: true,
            declared: error(0),
            calibrated: error(1),
            augmented: error(2),
            repeats: repeats(found, &output.name),
        }
    };
    models[0].outputs.iter().enumerate().map(row).collect()
}

/// Scatter of an output between repeats of a run; `None` where no input is repeated.
fn repeats(found: &Discovery, output: &str) -> Option<f64> {
    found.repeats.iter().find(|r| r.output == output || output.is_empty()).map(|r| r.sd)
}

/// Errors of a model's free runs by output; empty if a run diverges.
fn scores(model: &Model, data: &Dataset, burn_in: usize) -> Vec<Row> {
    let runs = records(data, model, false).and_then(|list| free_runs(model, &list, burn_in));
    runs.map(|runs| rows(model, &runs)).unwrap_or_default()
}

/// The table for people: one line for each output, then the effects.
fn text(result: &ResultFile) -> String {
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "{:<25}{:<15}{:>10}{:>12}{:>11}{:>10}{:>9}   errors on data that no fit has seen",
        "set", "output", "declared", "calibrated", "augmented", "repeats", "seconds"
    );
    let shown = |error: Option<f64>| error.map_or("-".to_owned(), |e| with_significant(e, 3));
    for row in &result.sets {
        for errors in &row.errors {
            let _ = writeln!(
                out,
                "{:<25}{:<15}{:>10}{:>12}{:>11}{:>10}{:>9.0}   {}",
                row.set,
                errors.output,
                shown(errors.declared),
                shown(errors.calibrated),
                shown(errors.augmented),
                shown(errors.repeats),
                row.seconds,
                errors.unit
            );
        }
        let _ = writeln!(out, "  {}", row.sentence);
        let _ = writeln!(out, "  known to lack: {}", row.lacks);
        let _ = writeln!(out, "  source: {}", row.source);
    }
    out
}
