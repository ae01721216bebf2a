//! `augsim train`: trains a network and writes a run directory.

use crate::args::Train;
use augsim_session::RunLock;
use augsim_session::run_data::published_predictor;
use augsim_session::run_dir::{CHECKPOINT, Config, DataSource, FILES, RunDir};
use augsim_session::training_run::{Trained, TrainingOutcome};
use augsim_session::usage::PathFault;
use augsim_session::{residual, run_data};
use augsim_terminal::destination::{RESULT, check_file};
use augsim_terminal::output::Output;
use augsim_terminal::record::RECORD;
use augsim_terminal::training;
use augsim_terminal::{Outcome, Usage};
use augsim_trainer::{Recipe, Settings};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Number of ball drops that are generated for training if no data are given, as in the paper.
const GENERATED_TRAJECTORIES: usize = 800;

#[derive(Serialize)]
struct Summary {
    run: PathBuf,
    recipe: Recipe,
    parameters: usize,
    iterations: u64,
    seconds_per_iteration: Option<f64>,
}

/// Runs `augsim train`: trains a network and writes a run directory.
pub fn run(args: &Train, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let model = args.residual_of.as_ref().map(|found| found.join(residual::MODEL));
    let inputs = args.data.iter().chain(&model).chain(&args.model).map(PathBuf::as_path);
    let inputs: Vec<&Path> = inputs.collect();
    for name in FILES {
        check_file(&args.out.join(name), &inputs)?;
    }
    let _lock = RunLock::take(&args.out)?;
    let run = RunDir::open(&args.out);
    let (config, notes) = match args.resume {
        true => (resumed_config(&run)?, Vec::new()),
        false => new_config(args, seed, force, &run)?,
    };
    let (train, warnings) = run_data::load_checked(&config)?;
    notes.iter().for_each(|note| output.note(note));
    output.warn(&warnings);
    if !args.resume {
        run.clear()?;
    }
    run.write_config(&config)?;
    match training::train(&run, &config, &train, args.resume, output)? {
        TrainingOutcome::Interrupted { iteration } => {
            output.notice(format!(
                "interrupted after iteration {iteration}; resume with: augsim train --resume --out {}",
                args.out.display()
            ));
            Ok(Outcome::Interrupted)
        }
        TrainingOutcome::Trained(trained) => {
            print_trained(&trained, &config.settings, &args.out, output)?;
            Ok(Outcome::Done)
        }
    }
}

/// Reads the configuration of a run that is resumed, and checks that the run would not overwrite its data.
fn resumed_config(run: &RunDir) -> anyhow::Result<Config> {
    let config = run.read_config()?;
    if let DataSource::File(data) = &config.data {
        FILES.iter().try_for_each(|name| check_file(&run.file(name), &[data]))?;
    }
    Ok(config)
}

/// Makes the configuration of a new run from the options, with notes on the physics model.
fn new_config(args: &Train, seed: u64, force: bool, run: &RunDir) -> anyhow::Result<(Config, Vec<String>)> {
    if !force {
        check_free(run)?;
    }
    let data = match &args.data {
        Some(path) => DataSource::File(path.clone()),
        None => DataSource::DropDistribution { trajectories: GENERATED_TRAJECTORIES, seed },
    };
    let (engine, notes) = match args.corrected()? {
        Some((corrected, data)) => corrected.engine(&data, args.recipe)?,
        None => (published_predictor(), Vec::new()),
    };
    let config = Config {
        checkpoint_every: args.checkpoint_every,
        residual_of: args.residual_of.clone(),
        data,
        accept: args.accept.accept.clone(),
        settings: Settings::new(args.recipe, args.iterations, seed, engine),
    };
    Ok((config, notes))
}

/// Prints the summary of a finished training run.
fn print_trained(trained: &Trained, settings: &Settings, out: &Path, output: &Output) -> anyhow::Result<()> {
    if trained.model.shrinkage().is_some_and(|trust| trust.gain == 0.0) {
        output.note(
            "the corrections of the net do not improve free runs of held-out recordings: the mean forecasts are those of the \
             physics, with the standard deviations of the net",
        );
    }
    let Trained { parameters, seconds_per_iteration, .. } = *trained;
    let Settings { recipe, iterations, .. } = *settings;
    let summary = Summary { run: out.to_owned(), recipe, parameters, iterations, seconds_per_iteration };
    output.result(&summary, || {
        let rate = seconds_per_iteration.map_or(String::new(), |s| format!(", {:.1} ms each", s * 1e3));
        format!(
            "{}: {parameters} parameters, {iterations} iterations{rate}\nrun: {}",
            recipe.label(),
            out.display()
        )
    })
}

/// Checks that the folder holds no training run or result that would be overwritten.
fn check_free(run: &RunDir) -> anyhow::Result<()> {
    let found = [CHECKPOINT, RESULT, RECORD].into_iter().find(|name| run.file(name).exists());
    let Some(name) = found else { return Ok(()) };
    let fault = PathFault::Run { has_checkpoint: name == CHECKPOINT };
    Err(Usage::path(&run.file(name), fault).into())
}
