//! A training run from the command line: progress, metrics, checkpoints, interruption, resumption.

use crate::interrupt::Keeper;
use crate::output::Output;
use crate::progress::TrainingProgress;
use crate::run_dir::{Config, RunDir};
use crate::run_lock::RunLock;
use anyhow::Context;
use augsim_trainer::{Forecaster, NetModel, Sequences, Training};
use serde::Serialize;
use std::collections::BTreeMap;
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

/// Wall-clock times of trained nets, for `timing.json`.
#[derive(Debug, Serialize)]
pub struct Times {
    /// Seconds per training iteration of this session, by model; absent if nothing was left to do.
    seconds_per_iteration: BTreeMap<String, Option<f64>>,
}

impl Times {
    /// Of these nets.
    pub fn of<'a>(trained: impl IntoIterator<Item = &'a Trained>) -> Self {
        let each = |t: &Trained| (t.model.name().to_owned(), t.seconds_per_iteration);
        Times { seconds_per_iteration: trained.into_iter().map(each).collect() }
    }
}

/// Trains as `config` says, into the run directory `folder`; `None` if the user stopped it, which is said. With `resume` a
/// run that is there is gone on with, without it is begun anew.
///
/// # Errors
/// With `resume`: the run that is there has another configuration, and is not thrown away for that.
pub fn train_again(
    folder: &Path,
    config: &Config,
    data: &Sequences,
    resume: bool,
    output: &Output,
) -> anyhow::Result<Option<Trained>> {
    let _lock = RunLock::take(folder)?;
    let run = RunDir::open(folder);
    let resume = resume && run.checkpoint().exists();
    match resume {
        true => run.check_config(config)?,
        false => run.clear()?,
    }
    run.write_config(config)?;
    match train(&run, config, data, resume, output)? {
        Ended::Trained(trained) => Ok(Some(*trained)),
        Ended::Interrupted { iteration } => {
            output.notice(format!("interrupted after iteration {iteration}; go on with --resume"));
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
    // From the first file that is written on, the user who stops the run finds a checkpoint.
    let keeper = Keeper::new();
    let state = if resume { run.read_checkpoint()? } else { None };
    let mut training = match state {
        Some(state) => {
            let checkpoint = run.checkpoint();
            Training::resume(state, train).with_context(|| checkpoint.display().to_string())?
        }
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
        if keeper.must_stop() {
            progress.finish();
            run.write_checkpoint(training.state())?;
            return Ok(Ended::Interrupted { iteration: training.iteration() });
        }
        let losses = training.step()?;
        if losses.iteration.is_multiple_of(LOG_EVERY) || losses.iteration == total {
            metrics.push(&losses)?;
        }
        if losses.iteration.is_multiple_of(config.checkpoint_every) && losses.iteration < total {
            run.write_checkpoint(training.state())?;
        }
        progress.update(&losses);
    }
    progress.finish();
    // What follows looks at all training data once more, which may take longer than a signal leaves.
    run.write_checkpoint(training.state())?;
    if keeper.must_stop() {
        return Ok(Ended::Interrupted { iteration: training.iteration() });
    }
    let seconds = started.elapsed().as_secs_f64();
    let done = total - first;
    let state = training.finish()?.clone();
    run.write_checkpoint(&state)?;
    run.write_weights(training.params())?;
    Ok(Ended::Trained(Box::new(Trained {
        parameters: state.params.len(),
        model: NetModel::new(state)?,
        seconds_per_iteration: (done > 0).then(|| seconds / done as f64),
    })))
}
