//! Long work on a thread of its own: the interpreter's lock is free meanwhile, progress is told, Ctrl-C stops it.

use crate::error::{defect, raised, unlocked};
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

/// Longest time between two looks for signals.
const PATIENCE: Duration = Duration::from_millis(50);
/// Bytes of the thread's stack: that of a program's main thread.
const STACK: usize = 8 << 20;

/// Messages of the work to the caller.
enum Heard<T> {
    /// The step that it is at, and the share of the whole that is done, where it knows.
    Step(String, Option<f64>),
    /// How it ended.
    Done(thread::Result<anyhow::Result<T>>),
}

/// The worker's end of the line.
pub struct Line<T> {
    tell: Sender<Heard<T>>,
    stop: Arc<AtomicBool>,
}

/// Unwinds a worker that nobody waits for.
struct Stopped;

impl<T> Line<T> {
    /// Tells a step.
    pub fn step(&self, step: String, share: Option<f64>) {
        // Nobody listens any more once the caller was interrupted.
        let _ = self.tell.send(Heard::Step(step, share));
    }

    /// Whether the caller was interrupted.
    pub fn must_stop(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Ends work that cannot be asked to stop, if the caller was interrupted; no message is printed.
    pub fn end_if_stopped(&self) {
        if self.must_stop() {
            resume_unwind(Box::new(Stopped));
        }
    }
}

/// Does `work` on another thread and waits for it; `progress` is called with each step and share.
///
/// # Errors
/// The exception for the error or the panic of the work; `KeyboardInterrupt`, or what `progress` raises, at once: the work
/// then ends at its next step.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Line<T>) -> anyhow::Result<T> + Send + 'static,
) -> PyResult<T> {
    let (tell, mut hear) = channel();
    let stop = Arc::new(AtomicBool::new(false));
    let line = Line { tell, stop: Arc::clone(&stop) };
    let builder = thread::Builder::new().name("augsim".to_owned()).stack_size(STACK);
    builder.spawn(move || {
        let result = catch_unwind(AssertUnwindSafe(|| work(&line)));
        let _ = line.tell.send(Heard::Done(result));
    })?;
    let outcome = loop {
        let waited;
        (hear, waited) = py.detach(move || wait(hear));
        let heard = match waited {
            Ok(Heard::Done(result)) => break Ok(result),
            Ok(Heard::Step(step, share)) => progress.map_or(Ok(()), |p| p.call1((step, share)).map(drop)),
            Err(RecvTimeoutError::Timeout) => Ok(()),
            Err(RecvTimeoutError::Disconnected) => Err(defect(Box::new("the worker is gone"))),
        };
        // Steps of a training come faster than the wait lasts: signals are looked for after each, too.
        if let Err(e) = heard.and_then(|()| py.check_signals()) {
            break Err(e);
        }
    };
    match outcome {
        Ok(Ok(result)) => result.map_err(|e| raised(py, &e)),
        Ok(Err(panic)) => Err(defect(panic)),
        Err(e) => {
            stop.store(true, Ordering::Relaxed);
            Err(e)
        }
    }
}

/// Does brief work on the calling thread, where waiting for another would take longer, and any other as [`run`] does.
///
/// # Errors
/// As [`run`].
pub fn run_unless_brief<T: Send + 'static>(
    py: Python<'_>,
    is_brief: bool,
    work: impl FnOnce() -> anyhow::Result<T> + Send + 'static,
) -> PyResult<T> {
    if is_brief { unlocked(py, work) } else { run(py, None, move |_| work()) }
}

fn wait<T>(hear: Receiver<Heard<T>>) -> (Receiver<Heard<T>>, Result<Heard<T>, RecvTimeoutError>) {
    let heard = hear.recv_timeout(PATIENCE);
    (hear, heard)
}
