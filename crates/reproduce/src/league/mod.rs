//! `reproduce league`: all model classes under one protocol, in one table.
//!
//! Each class tries the same number of settings on the last fifth of the training data. The best setting
//! is trained on all training data with several seeds, and scored on test trajectories that no choice
//! was based on.

mod entrants;
mod factors;
mod measures;
mod page;
mod processor;
mod result;
mod rows;
mod runs;
mod sizes;
mod table;
mod verdict;

use crate::args::{LeagueScenario, Part, Reproduce};
use crate::experiment::Sizes;
use crate::experiment::data::{Data, Set, part};
use crate::reproduction::{claim, finish, repeat, test_seed};
use augsim_session::run_dir::DataSource;
use augsim_session::usage::Inapplicable;
use augsim_terminal::destination::Claim;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use augsim_terminal::{Outcome, Usage};
use augsim_trainer::Sequences;
use entrants::entrants;
use result::{League, ResultFile};
use runs::{Effort, Runs};
use sizes::Sizes as Curve;
use std::path::Path;

/// Runs `reproduce league`.
pub fn run(args: &Reproduce, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let out = args.out.clone().unwrap_or_else(|| "out/league".into());
    let scenarios = match args.part {
        Some(Part::Ball) => vec![LeagueScenario::Ball],
        Some(Part::Push) => vec![LeagueScenario::Push],
        Some(Part::Flights) => return Err(Usage::Inapplicable(Inapplicable::FlightsOfLeague).into()),
        None => vec![LeagueScenario::Ball, LeagueScenario::Push],
    };
    let named: Vec<&str> = scenarios.iter().map(|s| s.name()).collect();
    let record = Record::new("reproduce league")
        .setting("seed", seed)
        .setting("quick", args.quick)
        .setting("iterations", args.iterations.map_or("default".to_owned(), |n| n.to_string()))
        .setting("scenario", named.join(" and "));
    let mut words = vec!["league".to_owned(), "--seed".to_owned(), seed.to_string()];
    if let [one] = named[..] {
        words.extend(["--scenario".to_owned(), one.to_owned()]);
    }
    if args.quick {
        words.push("--quick".to_owned());
    }
    if let Some(iterations) = args.iterations {
        words.extend(["--iterations".to_owned(), iterations.to_string()]);
    }
    let inputs: Vec<&Path> = args.data.iter().map(AsRef::as_ref).collect();
    let claim = claim(&out, record, &inputs, args.resume, force)?;
    claim.begin()?;
    let mut leagues = Vec::new();
    for scenario in scenarios {
        let effort = Effort::for_scenario(scenario, args);
        match run_scenario(scenario, effort, seed, args.resume, &claim, output)? {
            Some(league) => leagues.push(league),
            None => return Ok(Outcome::Interrupted),
        }
    }
    let result = ResultFile { schema: "augsim.league/1", leagues, seed, command: repeat(words) };
    let page = |result: &ResultFile| Ok(page::page(result).render());
    let costs = Some(table::Costs::from_result(&result));
    finish(&claim, &result, page, costs, |result| table::table(result) + "\n", output)
}

/// Runs the comparison of one scenario; returns `None` if interrupted.
fn run_scenario(
    scenario: LeagueScenario,
    effort: Effort,
    seed: u64,
    resume: bool,
    claim: &Claim,
    output: &Output,
) -> anyhow::Result<Option<League>> {
    let (data, pool) = data(scenario, &effort, seed)?;
    let runs = Runs { data: &data, effort, seed, resume, claim, output, scenario };
    let mut rows = Vec::new();
    for entrant in entrants(scenario) {
        match runs.enter(entrant)? {
            Some(more) => rows.extend(more),
            None => return Ok(None),
        }
    }
    let sets: Vec<String> = data.tests.iter().map(set_name).collect();
    let verdicts = verdict::verdicts(&mut rows, &sets, seed);
    let curve = Curve { pool: &pool, counts: effort.sizes, seeds: effort.size_seeds };
    let Some(sizes) = curve.rows(&runs, &rows)? else { return Ok(None) };
    Ok(Some(League {
        scenario: scenario.name(),
        sets,
        training: data.train.items.len(),
        iterations: runs.effort.iterations,
        settings_tried: runs.effort.settings,
        seeds: runs.effort.seeds,
        rows: rows.into_iter().map(|r| r.row).collect(),
        sizes,
        verdicts,
    }))
}

/// Returns the name of a test set in the tables.
fn set_name(set: &Set) -> String {
    match &set.on {
        None => "test".to_owned(),
        Some((_, _, "test")) => "test".to_owned(),
        Some((object, surface, _)) => format!("{object} on {surface}"),
    }
}

/// Returns the data of a scenario, and the pool of trajectories for the learning curves.
///
/// The training sets of a learning curve are the first trajectories of the pool.
fn data(scenario: LeagueScenario, effort: &Effort, seed: u64) -> anyhow::Result<(Data, Sequences)> {
    match scenario {
        LeagueScenario::Ball => {
            let set = |trajectories, seed| DataSource::DropDistribution { trajectories, seed };
            let test = set(effort.test, test_seed(seed));
            let data = Data::drops(&set(effort.train, seed), &test)?.0;
            let pool = data.train.clone();
            Ok((data, pool))
        }
        LeagueScenario::Push => {
            let most = effort.sizes.iter().copied().max().unwrap_or(0).max(effort.train);
            let plan = Sizes { train: most, test: effort.test, transfer: effort.transfer, ..Sizes::quick() };
            let mut data = Data::laboratory(&plan, seed)?;
            let pool = data.train.clone();
            data.train = part(&pool, 0, effort.train);
            // The reduced version tests transfer on one surface only.
            let kept = |set: &Set| set.on.as_ref().is_none_or(|on| on.2 != "unseen surface" || on.1 == "pu");
            if effort.few_sets {
                data.tests.retain(kept);
            }
            Ok((data, pool))
        }
    }
}
