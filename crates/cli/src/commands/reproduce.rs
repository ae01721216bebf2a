//! `augsim reproduce`.

use crate::args::{Reproduce, Scenario};
use crate::ball::{self, Experiment, NetPlan};
use crate::chain;
use crate::command_line::quoted;
use crate::destination::{Claim, REPORT, RESULT, Results};
use crate::exit::{Outcome, Usage};
use crate::output::Output;
use crate::push;
use crate::record::Record;
use crate::run_dir::{CHECKPOINT, DataSource};
use augsim_trainer::Recipe;
use std::path::{Path, PathBuf};

/// The paper's numbers of training trajectories and iterations.
const TRAIN: usize = 800;
pub const ITERATIONS: u64 = 10_000;
/// Added to the seed of generated training data, so that test data are other draws.
const TEST_SEED_OFFSET: u64 = 1_000_000;

/// Runs the subcommand.
pub fn run(args: &Reproduce, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    match args.scenario {
        Scenario::Ball => ball(args, seed, force, output),
        Scenario::Push => pushing(args, seed, force, output),
        Scenario::Loop => chain::run(args, seed, force, output),
    }
}

fn ball(args: &Reproduce, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let out = args.out.clone().unwrap_or_else(|| "out/ball".into());
    let iterations = args.iterations.unwrap_or(if args.quick { ITERATIONS / 10 } else { ITERATIONS });
    if let Some(dir) = args.data.as_ref().filter(|dir| !dir.is_dir()) {
        anyhow::bail!(
            "{}: there is no such folder; give the one of `train.csv.gz` and `test_1000.csv.gz`; without --data drops of \
             the same law are generated",
            dir.display()
        );
    }
    let mut record = Record::new("reproduce ball").setting("seed", seed).setting("iterations", iterations);
    let mut words = words(&["ball", "--iterations", &iterations.to_string(), "--seed", &seed.to_string()]);
    let (train, test, test_name) = match &args.data {
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
    let mut inputs = Vec::new();
    for (name, source) in [("train", &train), ("test", &test)] {
        if let DataSource::File(path) = source {
            record = record.input(name, path);
            inputs.push(path.as_path());
        }
    }
    match &args.data {
        Some(folder) => words.extend(["--data".to_owned(), folder.display().to_string()]),
        None => {
            record = record.setting("test-drops", args.test_drops);
            words.extend(["--test-drops".to_owned(), args.test_drops.to_string()]);
        }
    }
    let claim = claim(&out, record, &inputs, args.resume, force)?;
    let experiment = Experiment {
        title: "Bouncing ball: forecasts from the first state".to_owned(),
        command: repeat(words),
        train,
        test,
        test_name,
        nets: [Recipe::Neural, Recipe::Hybrid, Recipe::HybridStandardised, Recipe::HybridPlus]
            .map(|recipe| NetPlan { recipe, iterations })
            .into(),
        seed,
        resume: args.resume,
    };
    let Some(finished) = experiment.run(&claim, output)? else { return Ok(Outcome::Interrupted) };
    output.result(&finished.result, || {
        format!("{}report: {}", ball::table(&finished.result.rows), finished.report.display())
    })?;
    Ok(Outcome::Done)
}

fn pushing(args: &Reproduce, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
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
    let mut record = Record::new("reproduce push")
        .setting("seed", seed)
        .setting("quick", args.quick)
        .setting("iterations", format!("{} and {}", plan.paper_iterations, plan.plus_iterations));
    let mut words = words(&["push", "--seed", &seed.to_string()]);
    if args.quick {
        words.push("--quick".to_owned());
    }
    if let Some(iterations) = args.iterations {
        words.extend(["--iterations".to_owned(), iterations.to_string()]);
    }
    if let Some(folder) = &args.data {
        words.extend(["--data".to_owned(), folder.display().to_string()]);
        record = record.input("data", folder);
    }
    let inputs: Vec<&Path> = args.data.iter().map(PathBuf::as_path).collect();
    let claim = claim(&out, record, &inputs, args.resume, force)?;
    let experiment = push::Experiment {
        command: repeat(words),
        plan,
        published,
        runs,
        quick: args.quick,
        seed,
        resume: args.resume,
    };
    let Some(finished) = experiment.run(&claim, output)? else { return Ok(Outcome::Interrupted) };
    output.result(&finished.result, || {
        format!("{}\nreport: {}", push::table(&finished.result), finished.report.display())
    })?;
    Ok(Outcome::Done)
}

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|&word| word.to_owned()).collect()
}

/// The command that repeats a reproduction, as a shell reads it; the folder of the results does not decide them.
pub fn repeat(words: Vec<String>) -> String {
    let head = ["augsim", "reproduce"].map(str::to_owned);
    let all: Vec<String> = head.into_iter().chain(words).chain(["--out", "DIR"].map(str::to_owned)).collect();
    quoted(&all)
}

/// Claims the folder of a reproduction. Nets that are there are gone on with or, with `force`, thrown away.
pub fn claim(
    folder: &Path,
    record: Record,
    inputs: &[&Path],
    resume: bool,
    force: bool,
) -> anyhow::Result<Claim> {
    let claim = Results { folder, files: &[RESULT, REPORT], inputs, record, force }.claim()?;
    if let Some(net) = trained_net(folder, 2).filter(|_| !resume && !force) {
        let text = format!(
            "{}: holds a net of this run already; add --resume to go on, or --force to train anew",
            net.display()
        );
        return Err(Usage(text).into());
    }
    Ok(claim)
}

/// A run directory with a checkpoint at most `depth` folders below `folder`.
fn trained_net(folder: &Path, depth: u32) -> Option<PathBuf> {
    if depth == 0 {
        return None;
    }
    let inner = std::fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path()).filter(|p| p.is_dir());
    let mut inner: Vec<PathBuf> = inner.collect();
    inner.sort_unstable();
    inner.into_iter().find_map(|path| match path.join(CHECKPOINT).exists() {
        true => Some(path),
        false => trained_net(&path, depth - 1),
    })
}
