//! The page of `reproduce loop`.

use super::ResultFile;
use super::sets::SetRow;
use crate::{ball, push};
use augsim_discovery::Rmse;
use augsim_report::page::{Block, Cell, Column, Page, Provenance, Row, Section, Table};
use std::path::Path;

/// The page; `command` repeats the run.
pub fn page(result: &ResultFile, data: &Path, command: &str) -> Page {
    let mut sections = vec![found("Measured sets", &result.sets)];
    if !result.chain.is_empty() {
        sections.push(chain_on_the_ball(&result.chain));
    }
    sections.push(found("Pushes of the virtual laboratory", std::slice::from_ref(&result.pushing.set)));
    sections.push(chain_on_pushing(&result.pushing.chain));
    let code = Block::Code { caption: String::new(), text: command.to_owned() };
    sections.push(Section { title: "How to reproduce".to_owned(), blocks: vec![code] });
    Page {
        overline: "closing the loop".to_owned(),
        title: "What data say about the models".to_owned(),
        summary: format!(
            "{} measured sets, and pushes of the virtual laboratory; each has a report of its own in its folder.",
            result.sets.len()
        ),
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

/// What the loop found in each set.
fn found(title: &str, sets: &[SetRow]) -> Section {
    let millimetres = |r: Rmse| Cell::estimate(1e3 * r.rmse, Some(r.ci95.map(|v| 1e3 * v)));
    let table = Table {
        caption: "Root mean square error on held-out trajectories, with 95 % intervals over trajectories. Of a ball the \
                  start is fitted to the part before the first impact and the rest is forecast; a push is forecast from \
                  its first pose."
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
        rows: sets
            .iter()
            .map(|s| {
                let e = &s.found.error;
                let verdict = serde_json::to_value(s.found.verdict).unwrap_or_default();
                let mut cells =
                    vec![Cell::text(&s.set), Cell::text(verdict.as_str().unwrap_or_default())];
                let errors = [e.declared, e.calibrated, e.augmented, e.reduction, e.noise_floor];
                cells.extend(errors.map(millimetres));
                Row { cells, ..Default::default() }
            })
            .collect(),
        ..Default::default()
    };
    let sentences = sets.iter().map(|s| (s.set.clone(), s.found.sentence.clone())).collect();
    Section { title: title.to_owned(), blocks: vec![Block::Table(table), Block::Definitions(sentences)] }
}

fn share(v: Option<f64>) -> Cell {
    Cell::number(v.map(|v| 100.0 * v))
}

fn chain_on_the_ball(chain: &[ball::Row]) -> Section {
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
    let cells = |r: &ball::Row| {
        vec![
            Cell::text(&r.model),
            Cell::number(Some(r.errors.trans_percent)),
            Cell::number(Some(r.errors.pos_m)),
            Cell::number(Some(r.errors.vel_m_s)),
            Cell::number(r.crps_pos_m),
            Cell::number(r.crps_vel_m_s),
            share(r.coverage50),
            share(r.coverage90),
        ]
    };
    let rows = chain.iter().map(|r| Row { cells: cells(r), ..Default::default() }).collect();
    let caption =
        "Forecasts from the first state, test_1000; mean of 10 samples, CRPS and bands of 100.".to_owned();
    section(
        "The ball: from the declared model to the net on the augmented one",
        Table { caption, columns, rows, ..Default::default() },
    )
}

fn chain_on_pushing(chain: &[push::Row]) -> Section {
    let columns = vec![
        Column::text("model"),
        Column::number("position", "mm").decimals(3),
        Column::number("rotation", "°").decimals(3),
        Column::number("CRPS position", "mm").decimals(3),
        Column::number("CRPS rotation", "°").decimals(3),
        Column::number("in 50 % band", "%").decimals(1),
        Column::number("in 90 % band", "%").decimals(1),
    ];
    let cells = |r: &push::Row| {
        vec![
            Cell::text(&r.model),
            Cell::number(Some(r.errors.pos_mm)),
            Cell::number(Some(r.errors.rot_deg)),
            Cell::number(Some(r.crps_mm)),
            Cell::number(Some(r.crps_deg)),
            share(r.coverage50),
            share(r.coverage90),
        ]
    };
    let rows = chain.iter().map(|r| Row { cells: cells(r), ..Default::default() }).collect();
    let set = chain.first().map_or(String::new(), push::Row::set);
    let caption = format!("Forecasts from the first pose and the rod's path, mean of 100 samples. {set}.");
    section(
        "Pushing: from the declared model to the net on the augmented one",
        Table { caption, columns, rows, ..Default::default() },
    )
}

fn section(title: &str, table: Table) -> Section {
    Section { title: title.to_owned(), blocks: vec![Block::Table(table)] }
}
