//! `reproduce loop`: the loop on measured sets, and the chain from the declared model to the net on the augmented one.

mod ball;
mod sets;

use crate::args::Reproduce;
use crate::ball::{Row, table};
use crate::commands::reproduce::ITERATIONS;
use crate::exit::{Outcome, Usage};
use crate::output::Output;
use crate::run_dir::RunDir;
use augsim_data::atomic_write;
use augsim_report::page::{Block, Cell, Column, Page, Provenance, Section, Table};
use serde::Serialize;
use sets::{PYBULLET, SetRow};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

#[derive(Serialize)]
struct ResultFile {
    schema: &'static str,
    scenario: &'static str,
    sets: Vec<SetRow>,
    /// The chain on the ball, `test_1000`; empty without that set.
    chain: Vec<Row>,
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
    let sets = sets::run(data, &out_dir, seed, output)?;
    let chain = match sets.iter().find(|s| s.set == PYBULLET) {
        None => Vec::new(),
        Some(row) => {
            let (folder, out) = (data.join(PYBULLET), out_dir.join("chain-ball"));
            let (found, resume) = (&row.found, args.resume);
            match (ball::Chain { data: &folder, out: &out, found, iterations, seed, resume }).run(output)? {
                Some(rows) => rows,
                None => return Ok(Outcome::Interrupted),
            }
        }
    };
    let result = ResultFile { schema: "augsim.reproduce/1", scenario: "loop", sets, chain, iterations, seed };
    let dir = RunDir::create(&out_dir)?;
    let json = serde_json::to_string_pretty(&result)?;
    atomic_write(&dir.file("result.json"), |w| w.write_all(json.as_bytes()))?;
    let report = dir.file("report.html");
    let html = page(&result, data).render();
    atomic_write(&report, |w| w.write_all(html.as_bytes()))?;
    output.result(&result, || format!("{}report: {}", text(&result), report.display()))?;
    Ok(Outcome::Done)
}

fn text(result: &ResultFile) -> String {
    let mut out = String::new();
    for s in &result.sets {
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
    out
}

fn page(result: &ResultFile, data: &Path) -> Page {
    let millimetres = |r: augsim_discovery::Rmse| Cell::estimate(1e3 * r.rmse, Some(r.ci95.map(|v| 1e3 * v)));
    let sets = Table {
        caption: "Root mean square error on held-out trajectories, with 95 % intervals over trajectories. The start is \
                  fitted to the part before the first impact; the rest is forecast."
            .to_owned(),
        columns: vec![
            Column::text("set"),
            Column::text("verdict"),
            Column::number("declared", "mm").decimals(1),
            Column::number("calibrated", "mm").decimals(1),
            Column::number("augmented", "mm").decimals(1),
            Column::number("reduction", "mm").decimals(1),
            Column::number("noise floor", "mm").decimals(1),
        ],
        rows: result
            .sets
            .iter()
            .map(|s| {
                let e = &s.found.error;
                let verdict = serde_json::to_value(s.found.verdict).unwrap_or_default();
                let mut cells =
                    vec![Cell::text(&s.set), Cell::text(verdict.as_str().unwrap_or_default())];
                let errors = [e.declared, e.calibrated, e.augmented, e.reduction, e.noise_floor];
                cells.extend(errors.map(millimetres));
                augsim_report::page::Row { cells, ..Default::default() }
            })
            .collect(),
        ..Default::default()
    };
    let found = result.sets.iter().map(|s| (s.set.clone(), s.found.sentence.clone())).collect();
    let mut sections = vec![Section {
        title: "Measured sets".to_owned(),
        blocks: vec![Block::Table(sets), Block::Definitions(found)],
    }];
    if !result.chain.is_empty() {
        let columns = vec![
            Column::text("model"),
            Column::number("trans", "%").decimals(2),
            Column::number("position", "m").decimals(4),
            Column::number("velocity", "m/s").decimals(4),
            Column::number("CRPS position", "m").decimals(4),
            Column::number("CRPS velocity", "m/s").decimals(4),
            Column::number("in 50 % band", "%").decimals(1),
            Column::number("in 90 % band", "%").decimals(1),
        ];
        let rows = result
            .chain
            .iter()
            .map(|r| {
                let share = |v: Option<f64>| Cell::number(v.map(|v| 100.0 * v));
                augsim_report::page::Row {
                    cells: vec![
                        Cell::text(&r.model),
                        Cell::number(Some(r.errors.trans_percent)),
                        Cell::number(Some(r.errors.pos_m)),
                        Cell::number(Some(r.errors.vel_m_s)),
                        Cell::number(r.crps_pos_m),
                        Cell::number(r.crps_vel_m_s),
                        share(r.coverage50),
                        share(r.coverage90),
                    ],
                    ..Default::default()
                }
            })
            .collect();
        let caption = "Forecasts from the first state, test_1000; mean of 10 samples, CRPS and bands of 100."
            .to_owned();
        sections.push(Section {
            title: "From the declared model to the net on the augmented one".to_owned(),
            blocks: vec![Block::Table(Table { caption, columns, rows, ..Default::default() })],
        });
    }
    Page {
        overline: "closing the loop".to_owned(),
        title: "What measured data say about the models".to_owned(),
        summary: format!("{} sets; each has a report of its own in its folder.", result.sets.len()),
        sections,
        provenance: Provenance {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: Some(result.seed),
            more: vec![("data".to_owned(), data.display().to_string())],
            ..Default::default()
        },
        ..Default::default()
    }
}
