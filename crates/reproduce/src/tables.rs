//! Runs `augsim reproduce`: one function per scenario.

use crate::absent::MissingData;
use crate::args::{NetArg, Reproduce, Scenario};
use crate::chain;
use crate::experiment::data::Data;
use crate::experiment::{Sizes, ball, push, runs_folder};
use crate::filtered;
use crate::league;
use crate::next;
use crate::reproduction::{claim, drop_sources, iterations, record_sources, repeat};
use crate::rigs;
use crate::robots;
use crate::systems;
use augsim_session::run_dir::DataSource;
use augsim_session::usage::Inapplicable;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use augsim_terminal::{Outcome, Usage};
use augsim_trainer::Recipe;
use std::path::{Path, PathBuf};

/// Runs `augsim reproduce` for the scenario in the options.
pub fn run(args: &Reproduce, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    if args.net.is_some() && args.scenario != Scenario::Push {
        return Err(Usage::Inapplicable(Inapplicable::NetAlone).into());
    }
    if args.part.is_some() && !matches!(args.scenario, Scenario::League | Scenario::Filtered) {
        return Err(Usage::Inapplicable(Inapplicable::OneScenario).into());
    }
    if args.pool.is_some() && args.scenario != Scenario::Next {
        return Err(Usage::Inapplicable(Inapplicable::PoolOfReproduction).into());
    }
    match args.scenario {
        Scenario::Ball => drops(args, seed, force, output),
        Scenario::Push => pushing(args, seed, force, output),
        Scenario::Loop => chain::run(args, seed, force, output),
        Scenario::Systems => systems::run(args, seed, force, output),
        Scenario::Robots => robots::run(args, seed, force, output),
        Scenario::Rigs => rigs::run(args, seed, force, output),
        Scenario::Filtered => filtered::run(args, seed, force, output),
        Scenario::League => league::run(args, seed, force, output),
        Scenario::Next => next::run(args, seed, force, output),
    }
}

fn drops(args: &Reproduce, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let out = args.out.clone().unwrap_or_else(|| "out/ball".into());
    let iterations = iterations(args);
    if let Some(dir) = args.data.as_ref().filter(|dir| !dir.is_dir()) {
        return Err(MissingData::Drops { folder: dir.clone() }.into());
    }
    let mut record = Record::new("reproduce ball").setting("seed", seed).setting("iterations", iterations);
    let mut words = words(&["ball", "--iterations", &iterations.to_string(), "--seed", &seed.to_string()]);
    let (train, test) = drop_sources(args, args.data.as_deref(), seed);
    let test_name = if args.data.is_some() { "test_1000" } else { "generated" };
    record = record_sources(record, &train, &test);
    let mut inputs = Vec::new();
    for source in [&train, &test] {
        if let DataSource::File(path) = source {
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
    let nets = [Recipe::Neural, Recipe::Hybrid, Recipe::HybridStandardised, Recipe::HybridPlus];
    let experiment = ball::experiment(
        "Bouncing ball: forecasts from the first state",
        test_name,
        &nets.map(|recipe| (recipe, iterations)),
        (repeat(words), seed, args.resume),
    );
    let (data, truth) = Data::drops(&train, &test)?;
    let Some(finished) = experiment.run(&data, Some(&truth), &claim, output)? else {
        return Ok(Outcome::Interrupted);
    };
    finished.print(output)?;
    Ok(Outcome::Done)
}

fn pushing(args: &Reproduce, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let (mut published, mut runs) = (None, None);
    if let Some(folder) = &args.data {
        published = Data::is_published(folder).then(|| folder.clone());
        runs = runs_folder(folder);
        if published.is_none() && runs.is_none() {
            return Err(MissingData::Pushes { folder: folder.clone() }.into());
        }
    }
    let plan = if args.quick { Sizes::quick() } else { Sizes::full() };
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
    let one = args
        .net
        .map(|net| push::OneNet { recipe: recipe(net), train_size: args.train_size.map(|n| n as usize) });
    if let Some(push::OneNet { recipe, train_size }) = one {
        let name = recipe.label().to_lowercase().replace('+', "-plus");
        record = record.setting("net", &name);
        words.extend(["--net".to_owned(), name]);
        if let Some(size) = train_size {
            record = record.setting("train-size", size);
            words.extend(["--train-size".to_owned(), size.to_string()]);
        }
    }
    if let Some(folder) = &args.data {
        words.extend(["--data".to_owned(), folder.display().to_string()]);
        record = record.input("data", folder);
    }
    let inputs: Vec<&Path> = args.data.iter().map(PathBuf::as_path).collect();
    let claim = claim(&out, record, &inputs, args.resume, force)?;
    let data = match &published {
        Some(folder) => Data::published(folder, &plan, seed)?,
        None => {
            output.note("no published files; generating pushes in the virtual laboratory");
            Data::laboratory(&plan, seed)?
        }
    };
    let data = match one.and_then(|one| one.train_size) {
        None => data,
        Some(size) => data.first(size)?,
    };
    let experiment =
        push::experiment(&plan, &data, one, runs, args.quick, (repeat(words), seed, args.resume));
    let Some(finished) = experiment.run(&data, None, &claim, output)? else {
        return Ok(Outcome::Interrupted);
    };
    finished.print(output)?;
    Ok(Outcome::Done)
}

/// Returns the model class that the network option selects.
fn recipe(net: NetArg) -> Recipe {
    match net {
        NetArg::Neural => Recipe::Neural,
        NetArg::NeuralPlus => Recipe::NeuralPlus,
        NetArg::Hybrid => Recipe::Hybrid,
        NetArg::HybridPlus => Recipe::HybridPlus,
    }
}

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|&word| word.to_owned()).collect()
}
