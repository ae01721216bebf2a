//! `reproduce next`: recorded runs chosen as `next` would choose them, against random order.

mod page;
mod pools;
mod replay;

use crate::absent::MissingData;
use crate::args::Reproduce;
use crate::reproduction::{claim, finish, repeat};
use augsim_session::usage::Missing;
use augsim_system::statistics::median;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use augsim_terminal::{Outcome, Usage};
use pools::{KNOWN, Known, Pool, read_pool};
use rayon::prelude::*;
use replay::{Order, Settings, replay};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Content of `result.json` of `reproduce next`.
#[derive(Debug, Serialize)]
struct ResultFile {
    schema: &'static str,
    scenario: &'static str,
    pools: Vec<PoolRow>,
    first: usize,
    seed: u64,
}

/// Results on one pool.
#[derive(Debug, Serialize)]
struct PoolRow {
    pool: String,
    runs: usize,
    explanations: Vec<String>,
    /// Most frequent verdict of the whole pool, and the number of orders that come to it.
    verdict: String,
    agreeing: usize,
    /// Median number of runs to the verdict of the whole pool; `None` if more than half of the orders do not come to it in 40 runs.
    designed: Option<f64>,
    random: Option<f64>,
    /// Median over the orders of the errors of the best explanation in multiples of its noise.
    error_ratio: f64,
    orders: Vec<Order>,
    /// Why other orders have no result.
    failed: Vec<String>,
}

/// Runs `reproduce next`.
pub fn run(args: &Reproduce, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let source = args.pool.as_deref().or(args.data.as_deref()).filter(|path| path.exists());
    let Some(source) = source else {
        return Err(Usage::Missing(Missing::MeasuredSets { scenario: "next" }).into());
    };
    let out = args.out.clone().unwrap_or_else(|| "out/replay".into());
    let settings = Settings { orders: args.orders as usize, first: args.first as usize, seed };
    let record = Record::new("reproduce next")
        .setting("seed", seed)
        .setting("orders", settings.orders)
        .setting("first", settings.first)
        .input("data", source)
        .inputs("explanation", &args.explanations);
    let mut inputs: Vec<&Path> = vec![source];
    inputs.extend(args.explanations.iter().map(std::path::PathBuf::as_path));
    let claim = claim(&out, record, &inputs, args.resume, force)?;
    let pools = match &args.pool {
        Some(pool) => vec![read_pool(pool, &args.explanations)?],
        None => known_pools(source, output)?,
    };
    claim.begin()?;
    let mut rows = Vec::new();
    for pool in &pools {
        output.note(format!("{}: {} runs, {} orders", pool.name, pool.runs.len(), settings.orders));
        rows.push(replayed(pool, settings, output)?);
    }
    let result = ResultFile {
        schema: "augsim.reproduce/1",
        scenario: "next",
        pools: rows,
        first: settings.first,
        seed,
    };
    let command = repeat(words(args, source, seed));
    let page = |result: &ResultFile| Ok(page::page(result, source, &command).render());
    finish(&claim, &result, page, Some(()), page::text, output)
}

/// Reads the built-in pools whose data are in the folder of all data sets.
fn known_pools(data: &Path, output: &Output) -> anyhow::Result<Vec<Pool>> {
    let (there, absent): (Vec<Known>, Vec<Known>) =
        KNOWN.into_iter().partition(|known| data.join(known.folder).is_dir());
    if there.is_empty() {
        let sets = vec!["servo-horn", "pneumatic-seal-friction"];
        return Err(MissingData::Systems { data: data.to_owned(), sets }.into());
    }
    for known in absent {
        output.note(format!("{}: not found, skipped", known.name()));
    }
    there.iter().map(|known| known.read(data)).collect()
}

/// Replays a pool in all orders. Orders that cannot be replayed are told.
///
/// # Errors
/// That of the last order, if none can be replayed.
fn replayed(pool: &Pool, settings: Settings, output: &Output) -> anyhow::Result<PoolRow> {
    let all: Vec<anyhow::Result<Order>> =
        (0..settings.orders as u64).into_par_iter().map(|order| replay(pool, settings, order)).collect();
    let (mut orders, mut failed) = (Vec::new(), Vec::new());
    for (number, order) in (1..).zip(all) {
        match order {
            Ok(order) => orders.push(order),
            Err(error) if orders.is_empty() && number == settings.orders => return Err(error),
            Err(error) => failed.push(format!("order {number}: {error:#}")),
        }
    }
    failed.iter().for_each(|why| output.note(format!("{}, {why}", pool.name)));
    let mut verdicts: BTreeMap<String, usize> = BTreeMap::new();
    for order in &orders {
        let left = if order.left.is_empty() { "none".to_owned() } else { order.left.join(", ") };
        *verdicts.entry(left).or_default() += 1;
    }
    let (verdict, agreeing) = verdicts.into_iter().max_by_key(|(_, count)| *count).unwrap_or_default();
    let runs = |of: fn(&Order) -> Option<usize>| {
        let count = |order: &Order| of(order).map_or(f64::INFINITY, |runs| runs as f64);
        Some(median(&mut orders.iter().map(count).collect::<Vec<f64>>())).filter(|runs| runs.is_finite())
    };
    Ok(PoolRow {
        pool: pool.name.clone(),
        runs: pool.runs.len(),
        explanations: pool.explanations.iter().map(|e| e.name.clone()).collect(),
        verdict,
        agreeing,
        designed: runs(|order| order.designed),
        random: runs(|order| order.random),
        error_ratio: median(&mut orders.iter().map(|o| o.error_ratio).collect::<Vec<f64>>()),
        orders,
        failed,
    })
}

/// Arguments that repeat the run.
fn words(args: &Reproduce, source: &Path, seed: u64) -> Vec<String> {
    let source = source.display().to_string();
    let mut words = vec!["next".to_owned()];
    match &args.pool {
        Some(_) => {
            words.extend([source, "--explanations".to_owned()]);
            words.extend(args.explanations.iter().map(|path| path.display().to_string()));
        }
        None => words.extend(["--data".to_owned(), source]),
    }
    for (name, value) in
        [("--orders", u64::from(args.orders)), ("--first", u64::from(args.first)), ("--seed", seed)]
    {
        words.extend([name.to_owned(), value.to_string()]);
    }
    words
}
