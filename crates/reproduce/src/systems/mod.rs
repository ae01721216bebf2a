//! `reproduce systems`: benchmark sets with declared, calibrated and augmented textbook models, formulas
//! without the effect library, and a network on the residual, in the metrics of the benchmarks.

mod net;
mod page;
mod sets;

use crate::absent::MissingData;
use crate::args::Reproduce;
use crate::measured::{self, NULL_RUNS, data_folder, discover_set};
use crate::reproduction::{claim, finish, repeat_on_data};
use anyhow::Context;
use augsim_data::{Dataset, atomic_write, write_dataset};
use augsim_equations::Model;
use augsim_session::equations::fit::fit;
use augsim_session::equations::forecast::{free_runs, rows};
use augsim_session::equations::records::records;
use augsim_session::{equations, folders};
use augsim_terminal::Outcome;
use augsim_terminal::destination::REPORT;
use augsim_terminal::discover_args::{Discover, Library};
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use net::{ITERATIONS, Net, Plan, net};
use serde::Serialize;
use sets::{Published, SETS, Set};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Content of `result.json` of `reproduce systems`.
type ResultFile = measured::ResultFile<SetRow>;

/// Scores and findings on one benchmark set.
#[derive(Debug, Serialize)]
struct SetRow {
    set: &'static str,
    metric: &'static str,
    source: &'static str,
    unit: &'static str,
    /// Test error of the declared model (next fields: of the calibrated and of the augmented model).
    declared: Option<f64>,
    calibrated: Option<f64>,
    augmented: Scored,
    /// Test error of a formula found without the effect library; absent in a reduced run.
    formula: Option<Scored>,
    /// Test scores of Hybrid+ on the residual of the augmented model; absent in a reduced run.
    hybrid: Option<Net>,
    published: &'static [Published],
}

/// Result of a discovery, with the error of its model on the test record.
#[derive(Debug, Serialize)]
struct Scored {
    /// Error of the free run on the test record, in the unit of the table; `None` if the run diverges.
    error: Option<f64>,
    kinds: Vec<String>,
    verdict: augsim_discovery::Verdict,
    sentence: String,
    /// Path of the discovery's report, relative to the results folder.
    report: PathBuf,
}

/// Runs `reproduce systems`.
pub fn run(args: &Reproduce, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let data = data_folder(args, "systems")?;
    let there: Vec<&Set> = SETS.iter().filter(|set| data.join(set.name).is_dir()).collect();
    if there.is_empty() {
        let sets = SETS.map(|set| set.name).to_vec();
        return Err(MissingData::Systems { data: data.to_owned(), sets }.into());
    }
    let out = args.out.clone().unwrap_or_else(|| "out/systems".into());
    let plan = Plan { iterations: args.iterations.unwrap_or(ITERATIONS), seed, resume: args.resume };
    let record = Record::new("reproduce systems")
        .setting("seed", seed)
        .setting("quick", args.quick)
        .setting("iterations", plan.iterations)
        .input("data", data);
    let claim = claim(&out, record, &[data], args.resume, force)?;
    claim.begin()?;
    for set in SETS.iter().filter(|set| !data.join(set.name).is_dir()) {
        output.note(format!("{}: not found, skipped", data.join(set.name).display()));
    }
    let mut sets = Vec::new();
    for set in there {
        match one(set, data, &out, (plan, args.quick), output)? {
            Some(row) => sets.push(row),
            None => return Ok(Outcome::Interrupted),
        }
    }
    let result = ResultFile::new("systems", sets, seed);
    let command = repeat_on_data("systems", args, data, seed);
    let page = |result: &ResultFile| Ok(page::page(result, data, &command).render());
    finish(&claim, &result, page, Some(()), text, output)
}

/// Calibrates and augments the model of a set, and scores all models; returns `None` if interrupted.
///
/// Training uses the training record, scores the test record.
fn one(
    set: &Set,
    data: &Path,
    out: &Path,
    (plan, quick): (Plan, bool),
    output: &Output,
) -> anyhow::Result<Option<SetRow>> {
    let records_of = (set.read)(&data.join(set.name))?;
    let folder = out.join(set.name);
    folders::make(&folder)?;
    let (model_path, train_path) = (folder.join("declared.toml"), folder.join("train.csv.gz"));
    atomic_write(&model_path, |w| w.write_all(set.model.as_bytes()))?;
    write_dataset(&records_of.train, &train_path)?;
    let test_path = folder.join("test.csv.gz");
    write_dataset(&records_of.test, &test_path)?;
    output.note(format!("{}: calibrating", set.name));
    let declared = equations::read(&model_path)?;
    let fitted = fit(&declared, &records(&records_of.train, &declared, true)?, None)?.model;
    // The file of the declared model leaves the input interpolation open, so it uses the interpolation
    // that was found.
    let mut as_declared = declared.clone();
    for (input, found) in as_declared.inputs.iter_mut().zip(&fitted.inputs) {
        input.hold = found.hold;
    }
    let score = |model: &Model| error(set, model, &records_of.test);
    let scored = |library: Library, sub: &Path, name: PathBuf| -> anyhow::Result<Scored> {
        let args = Discover {
            model: model_path.clone(),
            data: vec![train_path.clone()],
            out: sub.to_owned(),
            null_runs: NULL_RUNS,
            library,
            ..Discover::default()
        };
        let found = discover_set(set.name, &args, plan.seed, output)?;
        let augmented = sub.join("model.toml");
        let model = equations::read(&augmented).with_context(|| augmented.display().to_string())?;
        Ok(Scored {
            error: score(&model),
            kinds: found.effects.iter().map(|e| e.kind.clone()).collect(),
            verdict: found.verdict,
            sentence: found.sentence,
            report: name.join(REPORT),
        })
    };
    let augmented = scored(Library::Generic, &folder, PathBuf::from(set.name))?;
    let formula = if quick {
        None
    } else {
        let sub = folder.join("formula");
        folders::make(&sub)?;
        Some(scored(Library::None, &sub, Path::new(set.name).join("formula"))?)
    };
    let hybrid = if quick {
        None
    } else {
        output.note(format!("{}: training a network on the residual", set.name));
        match net(set, &folder, &test_path, plan, output)? {
            None => return Ok(None),
            trained => trained,
        }
    };
    Ok(Some(SetRow {
        set: set.name,
        metric: set.metric,
        source: set.source,
        unit: set.unit.0,
        declared: score(&as_declared),
        calibrated: score(&fitted),
        augmented,
        formula,
        hybrid,
        published: set.published,
    }))
}

/// Computes the error of a model's free run on the test record, in the unit of the table.
///
/// `None` if the run diverges.
fn error(set: &Set, model: &Model, test: &Dataset) -> Option<f64> {
    let list = records(test, model, false).ok()?;
    let runs = free_runs(model, &list, set.burn_in).ok()?;
    let row = rows(model, &runs).into_iter().next()?;
    Some(set.unit.1 * row.rmse).filter(|e| e.is_finite())
}

fn text(result: &ResultFile) -> String {
    let mut out = String::new();
    for s in &result.sets {
        let shown =
            |error: Option<f64>| error.map_or("diverged".to_owned(), |e| format!("{e:.3} {}", s.unit));
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{} ({})", s.set, s.metric);
        let _ = writeln!(out, "  declared {}, calibrated {}", shown(s.declared), shown(s.calibrated));
        let _ = writeln!(out, "  augmented {}: {}", shown(s.augmented.error), s.augmented.kinds.join(" + "));
        if let Some(formula) = &s.formula {
            let _ = writeln!(out, "  formulas only {}: {}", shown(formula.error), formula.kinds.join(" + "));
        }
        if let Some(net) = &s.hybrid {
            let _ = writeln!(
                out,
                "  Hybrid+ on the residual {}: CRPS {}, {:.0} % in the 50 % band, {:.0} % in the 90 % band, shrinkage factor {:.2}",
                shown(net.error),
                shown(net.crps),
                100.0 * net.coverage50,
                100.0 * net.coverage90,
                net.gain
            );
        }
        let published: Vec<String> = s
            .published
            .iter()
            .map(|p| {
                format!("{} {} {}{}", p.method, p.error, s.unit, if p.verified { "" } else { " (recalled)" })
            })
            .collect();
        let _ = writeln!(out, "  published: {}\n", published.join(", "));
    }
    out
}
