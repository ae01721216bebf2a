//! `reproduce loop`: discovery on measured sets, and networks on the declared and on the augmented
//! models.

mod ball;
mod nets;
mod page;
mod push;
mod sets;

use crate::args::Reproduce;
use crate::experiment::Sizes;
use crate::experiment::rows::{Row, table};
use crate::measured::data_folder;
use crate::reproduction::{claim, finish, iterations, repeat_on_data};
use augsim_terminal::Outcome;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use nets::Runs;
use push::Pushing;
use serde::Serialize;
pub use sets::PYBULLET;
use sets::SetRow;
use std::fmt::Write as _;

#[derive(Serialize)]
struct ResultFile {
    schema: &'static str,
    scenario: &'static str,
    sets: Vec<SetRow>,
    /// Scores of all models on the ball drops of `test_1000`; empty without that set.
    chain: Vec<Row>,
    /// Discovery and scores of all models on pushes of the virtual laboratory.
    pushing: Pushing,
    iterations: u64,
    seed: u64,
}

/// Runs `reproduce loop`.
pub fn run(args: &Reproduce, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let data = data_folder(args, "loop")?;
    let iterations = iterations(args);
    let out_dir = args.out.clone().unwrap_or_else(|| "out/loop".into());
    let record = Record::new("reproduce loop")
        .setting("seed", seed)
        .setting("quick", args.quick)
        .setting("iterations", iterations)
        .input("data", data);
    let claim = claim(&out_dir, record, &[data], args.resume, force)?;
    claim.begin()?;
    let runs = Runs { out: &out_dir, iterations, seed, resume: args.resume };
    let sets = sets::run(data, &out_dir, seed, output)?;
    let chain = match sets.iter().find(|s| s.set == PYBULLET) {
        None => Vec::new(),
        Some(row) => {
            let (folder, out) = (data.join(PYBULLET), out_dir.join("chain-ball"));
            let runs = Runs { out: &out, ..runs };
            match ball::chain(&folder, &row.found, row.trajectories, runs, output)? {
                Some(rows) => rows,
                None => return Ok(Outcome::Interrupted),
            }
        }
    };
    let plan = if args.quick { Sizes::quick() } else { Sizes::full() };
    let Some(pushing) = push::chain(&plan, runs, output)? else { return Ok(Outcome::Interrupted) };
    let result =
        ResultFile { schema: "augsim.reproduce/1", scenario: "loop", sets, chain, pushing, iterations, seed };
    let command = repeat_on_data("loop", args, data, seed);
    let page = |result: &ResultFile| Ok(page::page(result, data, &command).render());
    finish(&claim, &result, page, Some(()), text, output)
}

fn text(result: &ResultFile) -> String {
    let mut out = String::new();
    for s in result.sets.iter().chain([&result.pushing.set]) {
        let e = &s.found.error;
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{} ({} trajectories)\n  {}", s.set, s.trajectories, s.found.sentence);
        let _ = writeln!(
            out,
            "  error on {} held-out trajectories: declared {:.2} mm, calibrated {:.2} mm, augmented {:.2} mm;\n  \
             reduction {:.2} mm (95 % interval {:.2} to {:.2} mm)\n",
            e.heldout_trajectories,
            1e3 * e.declared.rmse,
            1e3 * e.calibrated.rmse,
            1e3 * e.augmented.rmse,
            1e3 * e.reduction.rmse,
            1e3 * e.reduction.ci95[0],
            1e3 * e.reduction.ci95[1]
        );
    }
    if !result.chain.is_empty() {
        let _ = writeln!(out, "models on {PYBULLET}, test_1000\n{}", table(&result.chain));
    }
    let _ = writeln!(out, "models on pushing\n{}", table(&result.pushing.chain));
    out
}
