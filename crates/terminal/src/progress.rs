//! Shows progress on standard error: bars on a terminal, lines elsewhere.

use crate::output::Output;
use augsim_trainer::Losses;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Progress bar of a training: iteration, losses, rate and remaining time.
#[derive(Debug)]
pub struct TrainingProgress(ProgressBar);

impl TrainingProgress {
    /// Starts the progress bar of a training of `total` iterations, of which `done` are complete.
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

    /// Shows the losses of a finished iteration in the progress bar.
    pub fn update(&self, losses: &Losses) {
        self.0.set_position(losses.iteration);
        if losses.iteration.is_multiple_of(10) {
            self.0.set_message(format!(
                "loss {:.1} nats (KL {:.1}, misfit {:.1})",
                losses.loss, losses.kl, losses.negative_ln_likelihood
            ));
        }
    }

    /// Removes the progress bar from the terminal.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}

/// Time between progress lines where standard error is not a terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(10);
/// Number of positions of a progress bar.
const BAR_STEPS: u64 = 1000;

/// Progress of a command with named steps: a bar on a terminal, a line every ten seconds elsewhere.
#[derive(Debug)]
pub struct Steps {
    bar: ProgressBar,
    lines: Option<Lines>,
}

/// Thread that prints the current step from time to time, for log files.
#[derive(Debug)]
struct Lines {
    now: Arc<Mutex<String>>,
    /// Sender that is dropped at the end to stop the printing thread.
    end: Option<Sender<()>>,
    writer: Option<JoinHandle<()>>,
}

impl Steps {
    /// Starts the progress display, which is empty until the first step.
    pub fn new(output: &Output) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let target = if output.shows_progress() && terminal {
            ProgressDrawTarget::stderr_with_hz(5)
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(Some(BAR_STEPS), target);
        if let Ok(style) = ProgressStyle::with_template("{spinner} {bar:20} {elapsed}  {msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        let lines = (output.shows_progress() && !terminal).then(|| Lines::new(*output));
        Steps { bar, lines }
    }

    /// Shows the current step and the completed fraction of the command, from 0 to 1.
    pub fn show_part(&self, step: &'static str, done: f64) {
        self.bar.set_position((BAR_STEPS as f64 * done) as u64);
        self.set_step(step.to_owned());
    }

    /// Shows a step with variable text and no completed fraction.
    pub fn show_step(&self, step: String) {
        self.set_step(step);
    }

    fn set_step(&self, step: String) {
        if let Some(lines) = &self.lines
            && let Ok(mut now) = lines.now.lock()
        {
            now.clone_from(&step);
        }
        self.bar.set_message(step);
    }

    /// Removes the progress bar from the terminal.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Lines {
    fn new(output: Output) -> Self {
        let now = Arc::new(Mutex::new(String::new()));
        let (end, ended) = channel::<()>();
        let (shared, begun) = (Arc::clone(&now), Instant::now());
        let write = move || {
            while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(LINE_INTERVAL) {
                if let Ok(now) = shared.lock() {
                    output.note(line(begun.elapsed().as_secs_f64(), &now));
                }
            }
        };
        // Without room for another thread there are no lines.
        let writer = std::thread::Builder::new().spawn(write).ok();
        Lines { now, end: Some(end), writer }
    }
}

impl Drop for Lines {
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(writer) = self.writer.take() {
            // A panic of the writer does not affect the work.
            let _ = writer.join();
        }
    }
}

/// Formats a progress line: elapsed time and step.
///
/// It predicts no remaining time: stages and rounds of a search differ so much in length that an
/// extrapolation from the finished ones grows as one waits.
fn line(seconds: f64, step: &str) -> String {
    format!("after {seconds:.0} s: {step}")
}

#[cfg(test)]
mod tests {
    //! Contract: a line shows the time and the step.
    use super::line;

    #[test]
    fn shows_the_time_and_the_step() {
        assert_eq!(line(10.4, "reading"), "after 10 s: reading");
    }
}
