//! `augsim discover`.

use crate::args::Discover;
use crate::destination::{Claim, REPORT, RESULT, Results};
use crate::discovery_page::{Subject, page};
use crate::exit::{Outcome, Usage};
use crate::output::Output;
use crate::progress::Steps;
use crate::record::Record;
use crate::written;
use augsim_data::{Dataset, MissingCells, Trajectory, read_dataset};
use augsim_discovery::{Discovery, Options, Rmse, discover};
use augsim_physics::model::ModelFile;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Runs the subcommand.
pub fn run(args: &Discover, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    if !(args.train_share > 0.0 && args.train_share < 1.0) {
        return Err(Usage(format!("--train-share {}: must lie between 0 and 1", args.train_share)).into());
    }
    let found = close_loop(args, seed, force, output)?;
    output.result(&found, || text(args, &found))?;
    Ok(Outcome::Done)
}

/// Name of the augmented model.
const MODEL: &str = "model.toml";

/// Makes the discovery and writes `result.json`, `model.toml` and `report.html`. With `force` it replaces what another run
/// left in the folder.
pub fn close_loop(args: &Discover, seed: u64, force: bool, output: &Output) -> anyhow::Result<Discovery> {
    let claim = claim(args, seed, force)?;
    let accepted = args.accept.accept.iter().copied().collect();
    let options = Options { seed, train_share: args.train_share, accepted };
    let steps = Steps::new(output);
    let mut told = |p: augsim_discovery::Progress| steps.show(p.describe());
    let (found, subject) = if written::is_model(&args.model) {
        let model = written::read(&args.model)?;
        told(augsim_discovery::Progress::Calibration);
        let (declared, data) = written::discovery::measured(&model, &args.data)?;
        let data = of_groups(args, data)?;
        (discover(&declared, &data, &options, &mut told)?, Subject::from(&model))
    } else {
        let mut model = ModelFile::read(&args.model)?;
        let data = of_groups(args, read_dataset(&args.data, MissingCells::AsGap)?)?;
        if !args.group.is_empty() {
            // The model may have values for groups that were not asked for.
            model.keep_groups(&args.group);
        }
        (discover(model.declaration(), &data, &options, &mut told)?, Subject::from(&model))
    };
    steps.finish();
    output.warn(&found.warnings);

    claim.begin()?;
    claim.write(RESULT, &serde_json::to_string_pretty(&found)?)?;
    claim.write(MODEL, &found.model_toml)?;
    claim.write(REPORT, &augsim_report::discovery_report(&page(args, seed, &subject, &found)))?;
    claim.write_timing(())?;
    Ok(found)
}

/// The folder of the results, for these settings and inputs.
fn claim(args: &Discover, seed: u64, force: bool) -> anyhow::Result<Claim> {
    let record = Record::new("discover")
        .setting("seed", seed)
        .setting("train-share", args.train_share)
        .setting("group", args.group.join(", "))
        .setting("accept", args.accept.accept.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "))
        .input("model", &args.model)
        .input("data", &args.data);
    let (files, inputs) = (&[RESULT, MODEL, REPORT], &[args.model.as_path(), &args.data]);
    Results { folder: &args.out, files, inputs, record, force }.claim()
}

/// The trajectories of the groups asked for; all without such a wish.
fn of_groups(args: &Discover, data: Dataset) -> anyhow::Result<Dataset> {
    if args.group.is_empty() {
        return Ok(data);
    }
    let known: BTreeSet<&str> = data.trajectories().iter().filter_map(Trajectory::group).collect();
    if let Some(unknown) = args.group.iter().find(|g| !known.contains(g.as_str())) {
        let list: Vec<&str> = known.into_iter().collect();
        let file = args.data.display();
        let remedy = if list.is_empty() {
            format!("{file} has no column `group`; leave --group out")
        } else {
            format!("{file} has {}", list.join(", "))
        };
        return Err(Usage(format!("--group {unknown}: no trajectory is in this group; {remedy}")).into());
    }
    let wanted = |t: &Trajectory| t.group().is_some_and(|g| args.group.iter().any(|w| w == g));
    let all = data.trajectories().iter().enumerate();
    let indices: Vec<usize> = all.filter(|(_, t)| wanted(t)).map(|(i, _)| i).collect();
    Ok(data.select(&indices))
}

/// The result in a few lines.
fn text(args: &Discover, d: &Discovery) -> String {
    let mut out = format!("{}\n\n", d.sentence);
    // Writing to a string cannot fail.
    for effect in &d.effects {
        for (name, e) in &effect.parameters {
            let ([low, high], d) = (e.ci95, e.decimals());
            let _ = writeln!(
                out,
                "  {}: {name} = {:.d$} {} (95 % interval {low:.d$} to {high:.d$}){}",
                effect.kind,
                e.value,
                e.unit,
                if e.groups.is_empty() { "" } else { ", the mean over groups:" }
            );
            for (group, e) in &e.groups {
                let _ = writeln!(out, "    {group}: {e} {}", e.unit);
            }
        }
    }
    let e = &d.error;
    let _ = writeln!(
        out,
        "\n  error on {} held-out trajectories{}, {} (95 % interval)",
        e.heldout_trajectories,
        e.folds.map_or(String::new(), |n| format!(" of {n} folds")),
        e.unit
    );
    let rows = [
        ("declared", e.declared),
        ("calibrated", e.calibrated),
        ("augmented", e.augmented),
        ("noise floor", e.noise_floor),
        ("reduction", e.reduction),
    ];
    for (name, r) in rows {
        let _ = writeln!(out, "  {name:<12} {:>10.5}  ({:.5} to {:.5})", r.rmse, r.ci95[0], r.ci95[1]);
    }
    for (measure, e) in &d.errors {
        let _ = writeln!(
            out,
            "  {measure}, {}: declared {:.3}, calibrated {:.3}, augmented {:.3}, noise floor {:.3}",
            e.unit, e.declared.rmse, e.calibrated.rmse, e.augmented.rmse, e.noise_floor.rmse
        );
    }
    let row = |r: &Rmse| format!("{:.3} ({:.3} to {:.3})", r.rmse, r.ci95[0], r.ci95[1]);
    for h in &d.horizons {
        let _ = writeln!(out, "  after {} s, {} forecasts:", h.horizon_s, h.forecasts);
        for (measure, e) in &h.errors {
            let _ = writeln!(
                out,
                "    {measure}, {}: declared {}, calibrated {}, augmented {}, gain {}",
                e.unit,
                row(&e.declared),
                row(&e.calibrated),
                row(&e.augmented),
                row(&e.reduction)
            );
        }
    }
    if let (Some(rule), Some(dispersion)) = (&d.windows.rule, d.dispersion) {
        let ([train, test], [a, b]) = (d.windows.fitted, d.windows.left_out);
        let _ = writeln!(
            out,
            "  windows: {train} to fit, {test} held out; of these {a} and {b} {rule}; dispersion {dispersion:.1}"
        );
    }
    for (name, e) in &d.parameters {
        let _ = writeln!(
            out,
            "  {name} = {:.5} {} (95 % interval {:.5} to {:.5})",
            e.value, e.unit, e.ci95[0], e.ci95[1]
        );
    }
    if let Some(share) = e.explained_share {
        let _ = writeln!(out, "  removed {:.1} % of the removable squared error", 100.0 * share);
    }
    if !d.next_experiment.is_empty() {
        let _ = writeln!(out, "\n  next experiment: {}", d.next_experiment);
    }
    let _ = writeln!(out, "\nreport: {}", args.out.join("report.html").display());
    out
}
