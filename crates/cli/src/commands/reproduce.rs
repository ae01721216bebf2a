//! `augsim reproduce`.

use crate::args::{Reproduce, Scenario};
use crate::ball::{self, Experiment, NetPlan};
use crate::chain;
use crate::exit::Outcome;
use crate::output::Output;
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
        Scenario::Loop => chain::run(args, seed, output),
    }
}

fn ball(args: &Reproduce, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
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
            args.out.display()
        ),
        train,
        test,
        test_name,
        nets: [Recipe::Neural, Recipe::Hybrid, Recipe::HybridStandardised, Recipe::HybridPlus]
            .map(|recipe| NetPlan { recipe, iterations })
            .into(),
        seed,
        out: args.out.clone(),
        resume: args.resume,
    };
    let Some(finished) = experiment.run(output)? else { return Ok(Outcome::Interrupted) };
    output.result(&finished.result, || {
        format!("{}report: {}", ball::table(&finished.result.rows), finished.report.display())
    })?;
    Ok(Outcome::Done)
}
