//! Threads on which functions of Python are called.

use pyo3::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Stack size of the threads in bytes, as for a main thread.
const STACK: usize = 8 << 20;
/// Maximum time that the end of the interpreter waits for the threads.
pub const MAX_WAIT: Duration = Duration::from_secs(3);
/// Time between two checks whether all threads have ended.
const POLL_INTERVAL: Duration = Duration::from_millis(2);

/// Number of threads that have not ended.
static RUNNING: AtomicUsize = AtomicUsize::new(0);

/// Counts a thread while it runs, also if it panics.
struct Running;

impl Running {
    fn new() -> Self {
        RUNNING.fetch_add(1, Ordering::SeqCst);
        Running
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        RUNNING.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Runs work on threads that stay known to Python, so that a call of a function costs little.
///
/// A thread that Python does not know gets a new state for each call, which takes longer than a short function.
///
/// # Errors
/// The threads cannot be started.
pub fn run<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> anyhow::Result<T> {
    let spawn = |pooled: rayon::ThreadBuilder| {
        let running = Running::new();
        let run = move || {
            let _running = running;
            Python::try_attach(|py| py.detach(|| pooled.run()));
        };
        thread::Builder::new().name("augsim-function".to_owned()).stack_size(STACK).spawn(run).map(drop)
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).spawn_handler(spawn).build()?;
    Ok(pool.install(work))
}

/// Waits until all threads have ended, for at most [`MAX_WAIT`].
pub fn wait_for_end() {
    let begin = Instant::now();
    while RUNNING.load(Ordering::SeqCst) > 0 && begin.elapsed() < MAX_WAIT {
        thread::sleep(POLL_INTERVAL);
    }
}
