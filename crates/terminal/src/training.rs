//! A training run from the command line: progress on the terminal, signals, and runs that are gone on with.

use crate::interrupt::Keeper;
use crate::output::Output;
use crate::progress::TrainingProgress;
use augsim_session::RunLock;
use augsim_session::run_dir::{Config, RunDir};
use augsim_session::training_run::{self, Begin, Ended, Trained, Watch};
use augsim_trainer::{Forecaster, Losses, Sequences};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Wall-clock times of trained nets, for `timing.json`.
#[derive(Debug, Serialize)]
pub struct Times {
    /// Seconds per training iteration of this session, by model; absent if nothing was left to do.
    seconds_per_iteration: BTreeMap<String, Option<f64>>,
}

impl Times {
    /// Collects the times of the trained nets.
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

/// Trains as `config` says, into `run`, with a bar on a terminal; a signal stops it after a checkpoint. With `resume` an
/// existing checkpoint is continued.
pub fn train(
    run: &RunDir,
    config: &Config,
    train: &Sequences,
    resume: bool,
    output: &Output,
) -> anyhow::Result<Ended> {
    // From the first file that is written on, the user who stops the run finds a checkpoint.
    let keeper = Keeper::new();
    let label = config.settings.recipe.label();
    let mut watch = Terminal { keeper, output, label, resume, progress: None };
    training_run::train(run, config, train, resume, &mut watch)
}

/// Shows a training run on the terminal.
#[derive(Debug)]
struct Terminal<'a> {
    keeper: Keeper,
    output: &'a Output,
    label: &'a str,
    resume: bool,
    progress: Option<TrainingProgress>,
}

impl Watch for Terminal<'_> {
    fn must_stop(&mut self) -> bool {
        self.keeper.must_stop()
    }

    fn begins(&mut self, from: Begin) {
        let Begin { parameters, trajectories, iteration, total } = from;
        self.output.detail(format!("{parameters} parameters, {trajectories} training trajectories"));
        if self.resume {
            self.output.note(format!("going on at iteration {iteration} of {total}"));
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
