//! A training run from the command line: progress, metrics, checkpoints, interruption, resumption.

use crate::interrupt;
use crate::output::Output;
use crate::progress::TrainingProgress;
use crate::run_dir::{Config, RunDir};
use augsim_nn::{checkpoint, weights};
use augsim_trainer::{NetModel, Sequences, Training};
use std::path::Path;
use std::time::Instant;

/// Iterations between lines of the metrics file.
const LOG_EVERY: u64 = 10;

/// How a training run ended.
#[derive(Debug)]
pub enum Ended {
    /// All iterations are done.
    Trained(Box<Trained>),
    /// The user stopped it; the checkpoint holds everything.
    Interrupted {
        /// Iterations done.
        iteration: u64,
    },
}

/// A finished run.
#[derive(Debug)]
pub struct Trained {
    /// The model.
    pub model: NetModel,
    /// Wall-clock seconds per iteration of this session; absent if nothing was left to do.
    pub seconds_per_iteration: Option<f64>,
    /// Number of parameters.
    pub parameters: usize,
}

/// Trains as `config` says, into the run directory `folder`; `None` if the user stopped it, which is said. With `resume` a
/// run that is there is gone on with, but a run with another configuration is not this run: it starts anew.
pub fn train_again(
    folder: &Path,
    config: &Config,
    data: &Sequences,
    resume: bool,
    output: &Output,
) -> anyhow::Result<Option<Trained>> {
    let run = RunDir::create(folder)?;
    let resume = resume && run.read_config().is_ok_and(|c| c == *config);
    run.write_config(config)?;
    match train(&run, config, data, resume, output)? {
        Ended::Trained(trained) => Ok(Some(*trained)),
        Ended::Interrupted { iteration } => {
            output.note(format!("interrupted after iteration {iteration}; go on with --resume"));
            Ok(None)
        }
    }
}

/// Trains as `config` says, into `run`. With `resume` an existing checkpoint is continued.
pub fn train(
    run: &RunDir,
    config: &Config,
    train: &Sequences,
    resume: bool,
    output: &Output,
) -> anyhow::Result<Ended> {
    let state = if resume { run.read_checkpoint()? } else { None };
    let mut training = match state {
        Some(state) => Training::resume(state, train)?,
        None => Training::new(config.settings.clone(), train)?,
    };
    let (total, first) = (config.settings.iterations, training.iteration());
    output.detail(format!(
        "{} parameters, {} training trajectories",
        training.params().values().len(),
        train.items.len()
    ));
    if resume {
        output.note(format!("going on at iteration {first} of {total}"));
    }
    let mut metrics = run.metrics_after(first)?;
    let progress = TrainingProgress::new(output, config.settings.recipe.label(), first, total);
    let started = Instant::now();
    while training.iteration() < total {
        if interrupt::requested() {
            progress.finish();
            checkpoint::save(&run.checkpoint(), training.state())?;
            return Ok(Ended::Interrupted { iteration: training.iteration() });
        }
        let losses = training.step()?;
        if losses.iteration.is_multiple_of(LOG_EVERY) || losses.iteration == total {
            metrics.push(&losses)?;
        }
        if losses.iteration.is_multiple_of(config.checkpoint_every) && losses.iteration < total {
            checkpoint::save(&run.checkpoint(), training.state())?;
        }
        progress.update(&losses);
    }
    progress.finish();
    let seconds = started.elapsed().as_secs_f64();
    let done = total - first;
    let state = training.finish()?.clone();
    checkpoint::save(&run.checkpoint(), &state)?;
    weights::export(&run.file("weights.safetensors"), training.params())?;
    Ok(Ended::Trained(Box::new(Trained {
        parameters: state.params.len(),
        model: NetModel::new(state)?,
        seconds_per_iteration: (done > 0).then(|| seconds / done as f64),
    })))
}
