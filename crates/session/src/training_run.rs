//! A training run into a run directory: metrics, checkpoints, interruption, resumption.

use crate::run_dir::{Config, RunDir};
use anyhow::Context;
use augsim_trainer::{Losses, NetModel, Sequences, Settings, Training, TrainingState};
use std::time::Instant;

/// Iterations between lines of the metrics file.
const LOG_EVERY: u64 = 10;

/// Whoever watches a training run, and may stop it.
pub trait Watch {
    /// Asked after each iteration: whether to write a checkpoint and stop.
    fn must_stop(&mut self) -> bool;
    /// Training begins, or goes on.
    fn begins(&mut self, from: Begin);
    /// An iteration is done.
    fn step(&mut self, losses: &Losses);
    /// No iteration comes any more.
    fn ends(&mut self);
}

/// The size of a training run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Begin {
    /// Number of parameters.
    pub parameters: usize,
    /// Number of training trajectories.
    pub trajectories: usize,
    /// Iterations that are done already.
    pub iteration: u64,
    /// Iterations in all.
    pub total: u64,
}

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

/// Trains as `config` says, into `run`. With `resume` an existing checkpoint is continued.
///
/// # Errors
/// The checkpoint is that of other settings or data, the training diverges, or a file cannot be written.
pub fn train(
    run: &RunDir,
    config: &Config,
    train: &Sequences,
    resume: bool,
    watch: &mut dyn Watch,
) -> anyhow::Result<Ended> {
    let state = if resume { run.read_checkpoint()? } else { None };
    let mut training = match state {
        Some(state) => {
            let checkpoint = run.checkpoint();
            Training::resume(state, train).with_context(|| checkpoint.display().to_string())?
        }
        None => Training::new(config.settings.clone(), train)?,
    };
    let (total, first) = (config.settings.iterations, training.iteration());
    let mut metrics = run.metrics_after(first)?;
    let (parameters, trajectories) = (training.params().values().len(), train.items.len());
    watch.begins(Begin { parameters, trajectories, iteration: first, total });
    let started = Instant::now();
    while training.iteration() < total {
        if watch.must_stop() {
            watch.ends();
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
        watch.step(&losses);
    }
    watch.ends();
    // What follows looks at all training data once more, which may take longer than a signal leaves.
    run.write_checkpoint(training.state())?;
    if watch.must_stop() {
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

/// Trains in memory, without files: `None` if the watcher stopped it. The same settings and data give the same net as
/// [`train`].
///
/// # Errors
/// The settings do not fit the data, or the training diverges.
pub fn train_in_memory(
    settings: &Settings,
    train: &Sequences,
    watch: &mut dyn Watch,
) -> anyhow::Result<Option<TrainingState>> {
    let mut training = Training::new(settings.clone(), train)?;
    let (parameters, trajectories) = (training.params().values().len(), train.items.len());
    watch.begins(Begin { parameters, trajectories, iteration: 0, total: settings.iterations });
    while training.iteration() < settings.iterations {
        if watch.must_stop() {
            watch.ends();
            return Ok(None);
        }
        let losses = training.step()?;
        watch.step(&losses);
    }
    watch.ends();
    Ok(Some(training.finish()?.clone()))
}
