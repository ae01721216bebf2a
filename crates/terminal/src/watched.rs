//! Runs work on its own thread, to return the best result so far at a time limit or a signal.
//!
//! The work reports interim results. When the limit passes or a signal arrives, the last of them is the
//! result, and the thread is abandoned: it ends with the process.

use crate::interrupt::{self, CheckpointGuard};
use crate::threads::no_room;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

/// Time between two checks of clock and signals.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Stack size of the working thread, bytes; equal to that of the main thread.
const STACK_BYTES: usize = 8 << 20;

/// Report from the working thread.
#[derive(Debug)]
pub enum Report<P, R> {
    /// The work reached this stage.
    Progress(P),
    /// The work has this best result so far.
    Interim(R),
    /// The work ended with this result or error.
    Finished(anyhow::Result<R>),
}

/// Reason why the work was stopped before its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The time limit of the work passed.
    TimeLimit,
    /// The process received a signal.
    Signal,
}

impl Stop {
    /// Words that continue the sentence "The search was stopped ...".
    pub fn cause(self) -> &'static str {
        match self {
            Stop::TimeLimit => "at its time limit",
            Stop::Signal => "by a signal",
        }
    }
}

/// Result of work that may have been stopped early.
#[derive(Debug)]
pub struct Watched<R> {
    /// Result of the work, or the best one so far; `None` if the time limit passed before there was any.
    pub result: Option<R>,
    /// Reason why the work was stopped early; `None` if it came to its end.
    pub stop: Option<Stop>,
}

/// Runs `work` until its end, the time `until`, or a signal; returns its last result.
///
/// A signal before the first interim result ends the process.
///
/// # Errors
/// Those of the work; the system has no room for another thread.
pub fn run_watched<P: Send + 'static, R: Send + 'static>(
    until: Option<Instant>,
    on_progress: &mut dyn FnMut(P),
    work: impl FnOnce(&Sender<Report<P, R>>) -> anyhow::Result<R> + Send + 'static,
) -> anyhow::Result<Watched<R>> {
    let guard = CheckpointGuard::new();
    let (sender, receiver) = channel();
    let body = move || {
        let finished = work(&sender);
        // The receiver is gone if the work was left.
        let _ = sender.send(Report::Finished(finished));
    };
    let thread = std::thread::Builder::new()
        .name("work".to_owned())
        .stack_size(STACK_BYTES)
        .spawn(body)
        .map_err(|error| no_room(&error))?;
    let mut best = None;
    match wait(&receiver, until, &guard, on_progress, &mut best) {
        Some(Ended::Finished(result)) => Ok(Watched { result: Some(result?), stop: None }),
        Some(Ended::Stopped(Stop::Signal)) if best.is_none() => interrupt::end_now(),
        Some(Ended::Stopped(stop)) => Ok(Watched { result: best, stop: Some(stop) }),
        None => match thread.join() {
            Err(panic) => std::panic::resume_unwind(panic),
            Ok(()) => anyhow::bail!("the work ended without a result"),
        },
    }
}

/// How waiting for the work ended: by its result, or by a stop.
enum Ended<R> {
    Finished(anyhow::Result<R>),
    Stopped(Stop),
}

/// Waits for the end of the work or a stop; `None` if the working thread ended without a result.
fn wait<P, R>(
    receiver: &Receiver<Report<P, R>>,
    until: Option<Instant>,
    guard: &CheckpointGuard,
    on_progress: &mut dyn FnMut(P),
    best: &mut Option<R>,
) -> Option<Ended<R>> {
    loop {
        match receiver.recv_timeout(POLL_INTERVAL) {
            Ok(Report::Progress(progress)) => on_progress(progress),
            Ok(Report::Interim(result)) => *best = Some(result),
            Ok(Report::Finished(result)) => return Some(Ended::Finished(result)),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return None,
        }
        if guard.must_stop() {
            return Some(Ended::Stopped(Stop::Signal));
        }
        if until.is_some_and(|until| Instant::now() >= until) {
            return Some(Ended::Stopped(Stop::TimeLimit));
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: at the limit the last interim result is returned although the work goes on; without a limit
    //! the end of the work is awaited.
    use super::*;

    fn slow(sender: &Sender<Report<u8, u8>>, seconds: f64) -> anyhow::Result<u8> {
        let _ = sender.send(Report::Interim(1));
        let _ = sender.send(Report::Interim(2));
        std::thread::sleep(Duration::from_secs_f64(seconds));
        Ok(3)
    }

    #[test]
    fn work_is_left_at_the_limit_with_the_best_result_so_far() {
        let start = Instant::now();
        let until = Some(start + Duration::from_millis(300));
        let left = run_watched(until, &mut |_: u8| {}, |sender| slow(sender, 30.0)).expect("a result");
        assert_eq!((left.result, left.stop), (Some(2), Some(Stop::TimeLimit)));
        assert!(start.elapsed() < Duration::from_secs(5));
        let done = run_watched(None, &mut |_: u8| {}, |sender| slow(sender, 0.2)).expect("a result");
        assert_eq!((done.result, done.stop), (Some(3), None));
        let nothing = run_watched(until, &mut |_: u8| {}, |_: &Sender<Report<u8, u8>>| {
            std::thread::sleep(Duration::from_secs(30));
            Ok(3)
        });
        assert_eq!(nothing.expect("no error").result, None);
    }
}
