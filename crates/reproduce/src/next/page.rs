//! Report page and text of `reproduce next`.

use super::{PoolRow, ResultFile};
use crate::reproduction::{how_to_reproduce, provenance};
use augsim_report::page::{Block, Cell, Column, Page, Row, Section, Table};
use std::fmt::Write;
use std::path::Path;

/// Makes the report page; `command` is the command line that repeats the run.
pub fn page(result: &ResultFile, data: &Path, command: &str) -> Page {
    let row = |pool: &PoolRow| Row {
        cells: vec![
            Cell::text(&pool.pool),
            Cell::text(pool.runs.to_string()),
            Cell::text(&pool.verdict),
            Cell::text(format!("{} of {}", pool.agreeing, pool.orders.len())),
            Cell::text(shown(pool.designed)),
            Cell::text(shown(pool.random)),
            Cell::text(format!("{:.1}", pool.error_ratio)),
        ],
        ..Default::default()
    };
    let titles = [
        "pool",
        "runs",
        "verdict of the whole pool: left are",
        "orders with this verdict",
        "runs to the verdict of the pool, designed (median)",
        "in random order (median)",
        "errors of the best explanation / its noise",
    ];
    let table = Table {
        columns: titles.iter().map(|title| Column::text(title)).collect(),
        rows: result.pools.iter().map(row).collect(),
        ..Default::default()
    };
    let mut sections = vec![Section::new("Pools", vec![Block::Table(table)])];
    sections.extend(result.pools.iter().map(orders));
    sections.push(how_to_reproduce(command));
    Page {
        overline: "the next experiment".to_owned(),
        title: "Recorded runs, chosen one by one".to_owned(),
        summary: format!(
            "The explanations were fitted to {} recordings, drawn at random. Further runs were then chosen from their recorded inputs, or at \
             random, and heard one by one until the explanations were rejected that all runs of the pool reject at odds of 1000 to 1.",
            result.first
        ),
        sections,
        provenance: provenance(result.seed, Some(data)),
        ..Default::default()
    }
}

/// Makes the section with the orders of a pool.
fn orders(pool: &PoolRow) -> Section {
    let row = |order: &super::Order| Row {
        cells: vec![
            Cell::text(order.first.join(", ")),
            Cell::text(order.left.join(", ")),
            Cell::text(shown(order.designed.map(|runs| runs as f64))),
            Cell::text(shown(order.random.map(|runs| runs as f64))),
            Cell::text(format!("{:.1}", order.error_ratio)),
        ],
        ..Default::default()
    };
    let titles = ["first recordings", "left by all runs", "runs, designed", "runs, random", "errors / noise"];
    let table = Table {
        caption: format!("Explanations: {}.", pool.explanations.join(", ")),
        columns: titles.iter().map(|title| Column::text(title)).collect(),
        rows: pool.orders.iter().map(row).collect(),
        ..Default::default()
    };
    let mut blocks = vec![Block::Table(table)];
    if !pool.failed.is_empty() {
        blocks.push(Block::Prose("Orders without a result, which no median counts:".to_owned()));
        blocks.push(Block::List(pool.failed.clone()));
    }
    Section::new(&pool.pool, blocks)
}

fn shown(runs: Option<f64>) -> String {
    runs.map_or_else(|| "not reached".to_owned(), |runs| runs.to_string())
}

/// The result as text for a terminal.
pub fn text(result: &ResultFile) -> String {
    let mut out = String::new();
    for pool in &result.pools {
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "{} ({} runs): {} left in {} of {} orders; runs to the verdict of the pool (median): designed {}, random {}; errors of the best \
             explanation {:.1} times its noise",
            pool.pool,
            pool.runs,
            pool.verdict,
            pool.agreeing,
            pool.orders.len(),
            shown(pool.designed),
            shown(pool.random),
            pool.error_ratio
        );
    }
    out + "\n"
}
