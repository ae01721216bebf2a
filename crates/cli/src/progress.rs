//! Progress of training, on standard error and only on a terminal.

use crate::output::Output;
use augsim_trainer::Losses;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::time::Duration;

/// A bar with iteration, loss parts, rate and time left.
#[derive(Debug)]
pub struct TrainingProgress(ProgressBar);

impl TrainingProgress {
    /// For a run of `total` iterations of which `done` are done.
    pub fn new(output: &Output, label: &str, done: u64, total: u64) -> Self {
        let target = if output.shows_progress() {
            ProgressDrawTarget::stderr_with_hz(5)
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(Some(total), target);
        let template = "{prefix:>8} {bar:24} {pos}/{len} it  {per_sec}  {eta} left  {msg}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.set_prefix(label.to_owned());
        bar.set_position(done);
        bar.reset_eta();
        bar.enable_steady_tick(Duration::from_millis(200));
        TrainingProgress(bar)
    }

    /// After an iteration.
    pub fn update(&self, losses: &Losses) {
        self.0.set_position(losses.iteration);
        if losses.iteration.is_multiple_of(10) {
            self.0.set_message(format!(
                "loss {:.1} nats (KL {:.1}, misfit {:.1})",
                losses.loss, losses.kl, losses.misfit
            ));
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}

/// The step that a shorter piece of work is at; shown once it takes longer than a moment.
#[derive(Debug)]
pub struct Steps(ProgressBar);

impl Steps {
    /// Nothing is shown until the first step.
    pub fn new(output: &Output) -> Self {
        let target = if output.shows_progress() {
            ProgressDrawTarget::stderr_with_hz(5)
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(None, target);
        if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed}  {msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Steps(bar)
    }

    /// The work is at this step.
    pub fn show(&self, step: &'static str) {
        self.0.set_message(step);
    }

    /// The work is at a step that has to be put into words.
    pub fn tell(&self, step: String) {
        self.0.set_message(step);
    }

    /// Takes the line away.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}
