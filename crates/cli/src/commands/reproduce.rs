//! `augsim reproduce`.

use crate::args::{Reproduce, Scenario};
use crate::ball::{self, Experiment, NetPlan};
use crate::chain;
use crate::exit::Outcome;
use crate::output::Output;
use crate::push;
use crate::run_dir::DataSource;
use augsim_trainer::Recipe;

/// The paper's numbers of training trajectories and iterations.
const TRAIN: usize = 800;
pub const ITERATIONS: u64 = 10_000;
/// Added to the seed of generated training data, so that test data are other draws.
const TEST_SEED_OFFSET: u64 = 1_000_000;

/// Runs the subcommand.
pub fn run(args: &Reproduce, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    match args.scenario {
        Scenario::Ball => ball(args, seed, output),
        Scenario::Push => pushing(args, seed, output),
        Scenario::Loop => chain::run(args, seed, output),
    }
}

fn ball(args: &Reproduce, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    let out = args.out.clone().unwrap_or_else(|| "out/ball".into());
    let iterations = args.iterations.unwrap_or(if args.quick { ITERATIONS / 10 } else { ITERATIONS });
    let published = args.data.as_ref().filter(|dir| {
        if !dir.exists() {
            output
                .note(format!("{} does not exist: generating drops of the same law instead", dir.display()));
        }
        dir.exists()
    });
    let (train, test, test_name) = match published {
        Some(dir) => (
            DataSource::File(dir.join("train.csv.gz")),
            DataSource::File(dir.join("test_1000.csv.gz")),
            "test_1000".to_owned(),
        ),
        None => (
            DataSource::PaperLaw { trajectories: TRAIN, seed },
            DataSource::PaperLaw {
                trajectories: args.test_drops as usize,
                seed: seed.wrapping_add(TEST_SEED_OFFSET),
            },
            "generated".to_owned(),
        ),
    };
    let data = published.map_or(String::new(), |d| format!(" --data {}", d.display()));
    let experiment = Experiment {
        title: "Bouncing ball: forecasts from the first state".to_owned(),
        command: format!(
            "augsim reproduce ball{data} --out {} --iterations {iterations} --seed {seed}",
            out.display()
        ),
        train,
        test,
        test_name,
        nets: [Recipe::Neural, Recipe::Hybrid, Recipe::HybridStandardised, Recipe::HybridPlus]
            .map(|recipe| NetPlan { recipe, iterations })
            .into(),
        seed,
        out,
        resume: args.resume,
    };
    let Some(finished) = experiment.run(output)? else { return Ok(Outcome::Interrupted) };
    output.result(&finished.result, || {
        format!("{}report: {}", ball::table(&finished.result.rows), finished.report.display())
    })?;
    Ok(Outcome::Done)
}

fn pushing(args: &Reproduce, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    let (mut published, mut runs) = (None, None);
    if let Some(folder) = &args.data {
        published = push::PushData::is_published(folder).then(|| folder.clone());
        runs = push::runs_folder(folder);
        if published.is_none() && runs.is_none() {
            anyhow::bail!(
                "{}: neither published MIT Push files (folders `abs`, `delrin`, `plywood`, `pu`) nor \
                 `mit-pusher-slider-runs` in it; without --data pushes are made in the virtual laboratory",
                folder.display()
            );
        }
    }
    let plan = if args.quick { push::Plan::quick() } else { push::Plan::full() };
    let plan = match args.iterations {
        Some(iterations) => plan.with_iterations(iterations),
        None => plan,
    };
    let out = args.out.clone().unwrap_or_else(|| "out/push".into());
    let mut command = format!("augsim reproduce push --out {} --seed {seed}", out.display());
    if let Some(folder) = &args.data {
        command.push_str(&format!(" --data {}", folder.display()));
    }
    if args.quick {
        command.push_str(" --quick");
    }
    if let Some(iterations) = args.iterations {
        command.push_str(&format!(" --iterations {iterations}"));
    }
    let experiment = push::Experiment {
        command,
        plan,
        published,
        runs,
        quick: args.quick,
        seed,
        out,
        resume: args.resume,
    };
    let Some(finished) = experiment.run(output)? else { return Ok(Outcome::Interrupted) };
    output.result(&finished.result, || {
        format!("{}\nreport: {}", push::table(&finished.result), finished.report.display())
    })?;
    Ok(Outcome::Done)
}
