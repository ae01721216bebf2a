//! `augsim train`: trains a network and writes a run directory.

use crate::args::Train;
use augsim_session::RunLock;
use augsim_session::run_data::published_predictor;
use augsim_session::run_dir::{CHECKPOINT, Config, DataSource, FILES, RunDir};
use augsim_session::training_run::TrainingOutcome;
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

/// Number of generated trajectories if no data are given, as in the paper.
const GENERATED_TRAJECTORIES: usize = 800;

#[derive(Serialize)]
struct Summary {
    run: PathBuf,
    recipe: Recipe,
    parameters: usize,
    iterations: u64,
    seconds_per_iteration: Option<f64>,
}

/// Runs the subcommand.
pub fn run(args: &Train, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let model = args.residual_of.as_ref().map(|found| found.join(residual::MODEL));
    let inputs = args.data.iter().chain(&model).chain(&args.model).map(PathBuf::as_path);
    let inputs: Vec<&Path> = inputs.collect();
    for name in FILES {
        check_file(&args.out.join(name), &inputs)?;
    }
    let _lock = RunLock::take(&args.out)?;
    let run = RunDir::open(&args.out);
    let mut notes = Vec::new();
    let config = match args.resume {
        true => {
            let config = run.read_config()?;
            if let DataSource::File(data) = &config.data {
                FILES.iter().try_for_each(|name| check_file(&run.file(name), &[data]))?;
            }
            config
        }
        false => {
            if !force {
                check_free(&run)?;
            }
            let data = match &args.data {
                Some(path) => DataSource::File(path.clone()),
                None => DataSource::DropDistribution { trajectories: GENERATED_TRAJECTORIES, seed },
            };
            let recipe = args.recipe;
            let engine = match args.corrected()? {
                Some((corrected, data)) => {
                    let (engine, engine_notes) = corrected.engine(&data, recipe)?;
                    notes = engine_notes;
                    engine
                }
                None => published_predictor(),
            };
            let settings = Settings::new(recipe, args.iterations, seed, engine);
            Config {
                checkpoint_every: args.checkpoint_every,
                residual_of: args.residual_of.clone(),
                data,
                accept: args.accept.accept.clone(),
                settings,
            }
        }
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
            if trained.model.shrinkage().is_some_and(|trust| trust.gain == 0.0) {
                output.note(
                    "the corrections of the net do not improve free runs of held-out recordings: the mean forecasts are those of the \
                     physics, with the standard deviations of the net",
                );
            }
            let summary = Summary {
                run: args.out.clone(),
                recipe: config.settings.recipe,
                parameters: trained.parameters,
                iterations: config.settings.iterations,
                seconds_per_iteration: trained.seconds_per_iteration,
            };
            output.result(&summary, || {
                let rate = trained
                    .seconds_per_iteration
                    .map_or(String::new(), |s| format!(", {:.1} ms each", s * 1e3));
                format!(
                    "{}: {} parameters, {} iterations{rate}\nrun: {}",
                    config.settings.recipe.label(),
                    trained.parameters,
                    config.settings.iterations,
                    args.out.display()
                )
            })?;
            Ok(Outcome::Done)
        }
    }
}

/// Refuses to overwrite the run of another command.
fn check_free(run: &RunDir) -> anyhow::Result<()> {
    let found = [CHECKPOINT, RESULT, RECORD].into_iter().find(|name| run.file(name).exists());
    let Some(name) = found else { return Ok(()) };
    let fault = PathFault::Run { has_checkpoint: name == CHECKPOINT };
    Err(Usage::path(&run.file(name), fault).into())
}
