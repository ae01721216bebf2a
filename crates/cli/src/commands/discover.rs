//! `augsim discover`.

use crate::args::Discover;
use crate::discovery_page::page;
use crate::exit::{Outcome, Usage};
use crate::output::Output;
use crate::progress::Steps;
use augsim_data::{MissingCells, atomic_write, read_dataset};
use augsim_discovery::{Discovery, Options, discover};
use augsim_physics::model::Model;
use std::fmt::Write as _;
use std::io::Write as _;

/// Runs the subcommand.
pub fn run(args: &Discover, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    if !(args.train_share > 0.0 && args.train_share < 1.0) {
        return Err(Usage(format!("--train-share {}: must lie between 0 and 1", args.train_share)).into());
    }
    let found = close_loop(args, seed, output)?;
    output.result(&found, || text(args, &found))?;
    Ok(Outcome::Done)
}

/// Makes the discovery and writes `result.json`, `model.toml` and `report.html`.
pub fn close_loop(args: &Discover, seed: u64, output: &Output) -> anyhow::Result<Discovery> {
    let model = Model::read(&args.model)?;
    let data = read_dataset(&args.data, MissingCells::AsGap)?;
    let options = Options { seed, train_share: args.train_share };
    let steps = Steps::new(output);
    let found = discover(&model, &data, &options, &mut |p| steps.show(p.describe()))?;
    steps.finish();

    std::fs::create_dir_all(&args.out)?;
    let write = |name: &str, text: &str| atomic_write(&args.out.join(name), |w| w.write_all(text.as_bytes()));
    write("result.json", &serde_json::to_string_pretty(&found)?)?;
    write("model.toml", &found.model_toml)?;
    write("report.html", &augsim_report::discovery_report(&page(args, seed, &model, &found)))?;
    Ok(found)
}

/// The result in a few lines.
fn text(args: &Discover, d: &Discovery) -> String {
    let mut out = format!("{}\n\n", d.sentence);
    // Writing to a string cannot fail.
    for effect in &d.effects {
        for (name, e) in &effect.parameters {
            let [low, high] = e.ci95;
            let _ = writeln!(
                out,
                "  {}: {name} = {:.4} {} (95 % interval {low:.4} to {high:.4})",
                effect.kind, e.value, e.unit
            );
        }
    }
    let e = &d.error;
    let _ = writeln!(
        out,
        "\n  error on {} held-out trajectories, {} (95 % interval)",
        e.heldout_trajectories, e.unit
    );
    let rows = [
        ("declared", e.declared),
        ("calibrated", e.calibrated),
        ("augmented", e.augmented),
        ("noise floor", e.noise_floor),
    ];
    for (name, r) in rows {
        let _ = writeln!(out, "  {name:<12} {:>10.5}  ({:.5} to {:.5})", r.rmse, r.ci95[0], r.ci95[1]);
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
