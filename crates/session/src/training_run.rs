//! Trains a net in a run directory, with metrics, checkpoints, interruption and resumption.

use crate::run_dir::{Config, RunDir};
use anyhow::Context;
use augsim_trainer::{Losses, NetModel, Sequences, Settings, Training, TrainingState};
use std::time::Instant;

/// Number of training iterations between lines of the metrics file.
const LOG_EVERY: u64 = 10;

/// Observer of a training run, which may stop it.
pub trait TrainingObserver {
    /// Whether training is to write a checkpoint and stop.
    ///
    /// It is asked before each iteration and before the final evaluation.
    fn must_stop(&mut self) -> bool;
    /// Receives size and progress of the training when it begins or resumes.
    fn begins(&mut self, from: TrainingStart);
    /// Receives the losses after each training iteration.
    fn step(&mut self, losses: &Losses);
    /// Is called once when the iterations end: all are done, or training is interrupted.
    fn ends(&mut self);
}

/// Size and progress of a training run when it begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TrainingStart {
    /// Number of trainable parameters of the net.
    pub parameters: usize,
    /// Number of training trajectories.
    pub trajectories: usize,
    /// Number of iterations that are already done.
    pub iteration: u64,
    /// Total number of iterations of the run.
    pub total: u64,
}

/// How a training run ended: finished or interrupted.
#[derive(Debug)]
pub enum TrainingOutcome {
    /// The run finished: all iterations are done.
    Trained(Box<Trained>),
    /// The observer stopped the run; the checkpoint has the full state.
    Interrupted {
        /// Number of iterations done.
        iteration: u64,
    },
}

/// The result of a finished training run.
#[derive(Debug)]
pub struct Trained {
    /// The trained net.
    pub model: NetModel,
    /// Wall-clock seconds per iteration of this call; `None` if no iteration was left to do.
    pub seconds_per_iteration: Option<f64>,
    /// Number of trainable parameters of the net.
    pub parameters: usize,
}

/// Trains a net as configured, and writes the results to the run directory `run`.
///
/// With `resume`, continues from a checkpoint if there is one.
///
/// # Errors
/// The checkpoint does not fit the data, the training diverges, or a file cannot be written.
pub fn train(
    run: &RunDir,
    config: &Config,
    train: &Sequences,
    resume: bool,
    watch: &mut dyn TrainingObserver,
) -> anyhow::Result<TrainingOutcome> {
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
    watch.begins(TrainingStart { parameters, trajectories, iteration: first, total });
    let started = Instant::now();
    while training.iteration() < total {
        if watch.must_stop() {
            watch.ends();
            run.write_checkpoint(training.state())?;
            return Ok(TrainingOutcome::Interrupted { iteration: training.iteration() });
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
    // `finish` evaluates all training data once more, which may take longer than the grace period after a
    // signal: save first.
    run.write_checkpoint(training.state())?;
    if watch.must_stop() {
        return Ok(TrainingOutcome::Interrupted { iteration: training.iteration() });
    }
    let seconds = started.elapsed().as_secs_f64();
    let done = total - first;
    let state = training.finish()?.clone();
    run.write_checkpoint(&state)?;
    run.write_weights(training.params())?;
    Ok(TrainingOutcome::Trained(Box::new(Trained {
        parameters: state.params.len(),
        model: NetModel::new(state)?,
        seconds_per_iteration: (done > 0).then(|| seconds / done as f64),
    })))
}

/// Trains a net in memory, without files; the net is identical to that of [`train`].
///
/// `None` if the observer stopped the training.
///
/// # Errors
/// The settings do not fit the data, or the training diverges.
pub fn train_in_memory(
    settings: &Settings,
    train: &Sequences,
    watch: &mut dyn TrainingObserver,
) -> anyhow::Result<Option<TrainingState>> {
    let mut training = Training::new(settings.clone(), train)?;
    let (parameters, trajectories) = (training.params().values().len(), train.items.len());
    watch.begins(TrainingStart { parameters, trajectories, iteration: 0, total: settings.iterations });
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
