//! Runs a training from the command line: progress, signals and resumed runs.

use crate::interrupt::CheckpointGuard;
use crate::output::Output;
use crate::progress::TrainingProgress;
use augsim_session::RunLock;
use augsim_session::run_dir::{Config, RunDir};
use augsim_session::training_run::{self, Trained, TrainingObserver, TrainingOutcome, TrainingStart};
use augsim_trainer::{Forecaster, Losses, Sequences};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Run times of trained networks, as written to `timing.json`.
#[derive(Debug, Serialize)]
pub struct Times {
    /// Seconds per training iteration in this session, by model; `None` if it was trained before.
    seconds_per_iteration: BTreeMap<String, Option<f64>>,
}

impl Times {
    /// Collects the training times of networks.
    pub fn from_trained<'a>(trained: impl IntoIterator<Item = &'a Trained>) -> Self {
        let time_of = |t: &Trained| (t.model.name().to_owned(), t.seconds_per_iteration);
        Times { seconds_per_iteration: trained.into_iter().map(time_of).collect() }
    }
}

/// Trains a network in the run directory `folder`; returns `None` if interrupted.
///
/// `resume` continues an existing run, otherwise the training starts from scratch. An interruption prints a
/// notice.
///
/// # Errors
/// With `resume`: the existing run has another configuration. It is not overwritten.
pub fn train_or_resume(
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
        TrainingOutcome::Trained(trained) => Ok(Some(*trained)),
        TrainingOutcome::Interrupted { iteration } => {
            output.notice(format!("interrupted after iteration {iteration}; resume with --resume"));
            Ok(None)
        }
    }
}

/// Trains a network into `run` with a progress bar; a signal stops it after a checkpoint.
///
/// `resume` continues an existing checkpoint.
pub fn train(
    run: &RunDir,
    config: &Config,
    train: &Sequences,
    resume: bool,
    output: &Output,
) -> anyhow::Result<TrainingOutcome> {
    // Listen for signals before the first file is written, so that an interrupted run always has a
    // checkpoint.
    let keeper = CheckpointGuard::new();
    let label = config.settings.recipe.label();
    let mut watch = Terminal { keeper, output, label, resume, progress: None };
    training_run::train(run, config, train, resume, &mut watch)
}

/// Display of a training on the terminal, which also stops it at a signal.
#[derive(Debug)]
struct Terminal<'a> {
    keeper: CheckpointGuard,
    output: &'a Output,
    label: &'a str,
    resume: bool,
    progress: Option<TrainingProgress>,
}

impl TrainingObserver for Terminal<'_> {
    fn must_stop(&mut self) -> bool {
        self.keeper.must_stop()
    }

    fn begins(&mut self, from: TrainingStart) {
        let TrainingStart { parameters, trajectories, iteration, total } = from;
        self.output.detail(format!("{parameters} parameters, {trajectories} training trajectories"));
        if self.resume {
            self.output.note(format!("resuming at iteration {iteration} of {total}"));
        }
        self.progress = Some(TrainingProgress::new(self.output, self.label, iteration, total));
    }

    fn step(&mut self, losses: &Losses) {
        if let Some(progress) = &self.progress {
            progress.update(losses);
        }
    }

    fn ends(&mut self) {
        if let Some(progress) = self.progress.take() {
            progress.finish();
        }
    }
}
