//! Runs long work on a separate thread: releases the GIL, reports progress, stops on Ctrl-C.

use crate::error::{defect, raised, unlocked};
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

/// Maximum time between two checks for signals such as Ctrl-C.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Stack size of the worker thread in bytes, as for a main thread.
const STACK: usize = 8 << 20;

/// Messages from the worker thread to the calling thread.
enum Message<T> {
    /// Name of the current step, and completed fraction of the work (0 to 1); `None` if unknown.
    Step(String, Option<f64>),
    /// Result of the work, or its panic.
    Done(thread::Result<anyhow::Result<T>>),
}

/// Connection of the worker thread to the calling thread: it reports progress and asks whether to stop.
pub struct Line<T> {
    tell: Sender<Message<T>>,
    stop: Arc<AtomicBool>,
}

/// Panic payload that ends a worker whose caller was interrupted, without a message.
struct Stopped;

impl<T> Line<T> {
    /// Reports the current step, and the completed fraction of the work (0 to 1) if it is known.
    pub fn step(&self, step: String, share: Option<f64>) {
        // The receiver is closed if the caller was interrupted.
        let _ = self.tell.send(Message::Step(step, share));
    }

    /// Whether the caller was interrupted, so that the work must stop.
    pub fn must_stop(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Ends the work if the caller was interrupted; prints no message. For work that has no stop check of its
    /// own.
    pub fn end_if_stopped(&self) {
        if self.must_stop() {
            resume_unwind(Box::new(Stopped));
        }
    }
}

/// Runs `work` on another thread and waits for it. Calls the Python function `progress` with each step and
/// fraction.
///
/// # Errors
/// The exception of an error or panic of the work. `KeyboardInterrupt`, or an exception of `progress`,
/// is raised at once, and the work then ends at its next step.
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
        let _ = line.tell.send(Message::Done(result));
    })?;
    let outcome = loop {
        let waited;
        (hear, waited) = py.detach(move || wait(hear));
        let message = match waited {
            Ok(Message::Done(result)) => break Ok(result),
            Ok(Message::Step(step, share)) => progress.map_or(Ok(()), |p| p.call1((step, share)).map(drop)),
            Err(RecvTimeoutError::Timeout) => Ok(()),
            Err(RecvTimeoutError::Disconnected) => Err(defect(Box::new("the worker is gone"))),
        };
        // Training reports steps faster than the polling interval, so signals are also checked after
        // each step.
        if let Err(e) = message.and_then(|()| py.check_signals()) {
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

/// Runs `work` on the calling thread if it is brief, which avoids a thread switch, and otherwise as [`run`]
/// does.
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

fn wait<T>(hear: Receiver<Message<T>>) -> (Receiver<Message<T>>, Result<Message<T>, RecvTimeoutError>) {
    let message = hear.recv_timeout(POLL_INTERVAL);
    (hear, message)
}
