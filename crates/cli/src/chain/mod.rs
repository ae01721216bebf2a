//! `reproduce loop`: the loop on measured sets, and the chain from the declared model to the net on the augmented one.

mod ball;
mod nets;
mod page;
mod push;
mod sets;

use crate::args::Reproduce;
use crate::ball::{Row, table};
use crate::commands::reproduce::ITERATIONS;
use crate::exit::{Outcome, Usage};
use crate::output::Output;
use crate::push::{Plan, sets as push_table};
use crate::run_dir::RunDir;
use augsim_data::atomic_write;
use nets::Runs;
use push::Pushing;
use serde::Serialize;
use sets::{PYBULLET, SetRow};
use std::fmt::Write as _;
use std::io::Write as _;

#[derive(Serialize)]
struct ResultFile {
    schema: &'static str,
    scenario: &'static str,
    sets: Vec<SetRow>,
    /// The chain on the ball, `test_1000`; empty without that set.
    chain: Vec<Row>,
    /// The loop and the chain on pushes of the virtual laboratory.
    pushing: Pushing,
    iterations: u64,
    seed: u64,
}

/// Runs it.
pub fn run(args: &Reproduce, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    let Some(data) = args.data.as_deref().filter(|d| d.is_dir()) else {
        let what = "reproduce loop reads measured data: give the folder of the sets with --data".to_owned();
        return Err(Usage(what).into());
    };
    let iterations = args.iterations.unwrap_or(if args.quick { ITERATIONS / 10 } else { ITERATIONS });
    let out_dir = args.out.clone().unwrap_or_else(|| "out/loop".into());
    let runs = Runs { out: &out_dir, iterations, seed, resume: args.resume };
    let sets = sets::run(data, &out_dir, seed, output)?;
    let chain = match sets.iter().find(|s| s.set == PYBULLET) {
        None => Vec::new(),
        Some(row) => {
            let (folder, out) = (data.join(PYBULLET), out_dir.join("chain-ball"));
            let runs = Runs { out: &out, ..runs };
            match (ball::Chain { data: &folder, found: &row.found, runs }).run(output)? {
                Some(rows) => rows,
                None => return Ok(Outcome::Interrupted),
            }
        }
    };
    let plan = if args.quick { Plan::quick() } else { Plan::full() };
    let Some(pushing) = (push::Chain { plan, runs }).run(output)? else { return Ok(Outcome::Interrupted) };
    let result =
        ResultFile { schema: "augsim.reproduce/1", scenario: "loop", sets, chain, pushing, iterations, seed };
    let dir = RunDir::create(&out_dir)?;
    let json = serde_json::to_string_pretty(&result)?;
    atomic_write(&dir.file("result.json"), |w| w.write_all(json.as_bytes()))?;
    let report = dir.file("report.html");
    let html = page::page(&result, data).render();
    atomic_write(&report, |w| w.write_all(html.as_bytes()))?;
    output.result(&result, || format!("{}report: {}", text(&result), report.display()))?;
    Ok(Outcome::Done)
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
        let _ = writeln!(out, "the chain on {PYBULLET}, test_1000\n{}", table(&result.chain));
    }
    let _ = writeln!(out, "the chain on pushing\n{}", push_table(&result.pushing.chain));
    out
}
