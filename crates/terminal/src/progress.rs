//! Progress on standard error: bars on a terminal, lines elsewhere.

use crate::output::Output;
use augsim_trainer::Losses;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A bar with iteration, loss parts, rate and time left.
#[derive(Debug)]
pub struct TrainingProgress(ProgressBar);

impl TrainingProgress {
    /// Begins the bar of a run of `total` iterations of which `done` are done.
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

/// Seconds between lines where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(10);
/// Thousandths that a bar is divided into.
const PARTS: u64 = 1000;

/// The step that a piece of work is at, the share that is done and the time that is left: a bar on a terminal, a line every
/// ten seconds elsewhere.
#[derive(Debug)]
pub struct Steps {
    bar: ProgressBar,
    lines: Option<Lines>,
}

/// Lines for who reads a log.
#[derive(Debug)]
struct Lines {
    now: Arc<Mutex<(String, f64)>>,
    /// Dropped when the work is done.
    end: Option<Sender<()>>,
    writer: Option<JoinHandle<()>>,
}

impl Steps {
    /// Nothing is shown until the first step.
    pub fn new(output: &Output) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let target = if output.shows_progress() && terminal {
            ProgressDrawTarget::stderr_with_hz(5)
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(Some(PARTS), target);
        if let Ok(style) = ProgressStyle::with_template(
            "{spinner} {bar:20} {percent:>3}%  {elapsed}  about {eta} left  {msg}",
        ) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        let lines = (output.shows_progress() && !terminal).then(|| Lines::new(*output));
        Steps { bar, lines }
    }

    /// The work is at this step, and so much of the whole is done, from 0 to 1.
    pub fn show_part(&self, step: &'static str, done: f64) {
        self.bar.set_position((PARTS as f64 * done) as u64);
        self.put(step.to_owned(), done);
    }

    /// The work is at a step that has to be put into words.
    pub fn tell(&self, step: String) {
        self.put(step, 0.0);
    }

    fn put(&self, step: String, done: f64) {
        if let Some(lines) = &self.lines
            && let Ok(mut now) = lines.now.lock()
        {
            *now = (step.clone(), done);
        }
        self.bar.set_message(step);
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Lines {
    fn new(output: Output) -> Self {
        let now = Arc::new(Mutex::new((String::new(), 0.0)));
        let (end, ended) = channel::<()>();
        let (shared, begun) = (Arc::clone(&now), Instant::now());
        let writer = std::thread::spawn(move || {
            while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(LINE_EVERY) {
                if let Ok(now) = shared.lock() {
                    output.note(line(begun.elapsed().as_secs_f64(), &now.0, now.1));
                }
            }
        });
        Lines { now, end: Some(end), writer: Some(writer) }
    }
}

impl Drop for Lines {
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(writer) = self.writer.take() {
            // A writer that panicked has nothing more to say.
            let _ = writer.join();
        }
    }
}

/// The line after so many seconds: what is being done, the share that is done, and when the end is to be expected.
fn line(seconds: f64, step: &str, done: f64) -> String {
    let left = if (0.01..1.0).contains(&done) {
        format!(", about {:.0} % done, about {:.0} s left", 100.0 * done, seconds * (1.0 - done) / done)
    } else {
        String::new()
    };
    format!("after {seconds:.0} s: {step}{left}")
}

#[cfg(test)]
mod tests {
    //! Contract: a line says the time, the step, and the end as far as it can be foreseen.
    use super::line;

    #[test]
    fn the_end_is_foreseen_from_the_share_that_is_done() {
        assert_eq!(line(10.0, "fitting", 0.25), "after 10 s: fitting, about 25 % done, about 30 s left");
        assert_eq!(line(10.4, "reading", 0.0), "after 10 s: reading");
    }
}
