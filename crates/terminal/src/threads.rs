//! Starts the worker threads of this process, as many as the system permits.

use crate::output::Output;
use anyhow::anyhow;
use std::io;
use std::sync::mpsc::channel;
use std::thread::Builder;

/// Number of threads beside the workers: for signals, for a stoppable command, for progress lines.
const OTHER_THREADS: usize = 3;

/// Starts `count` worker threads, or one per core; fewer if the system does not permit them.
///
/// Results do not depend on the number.
///
/// # Errors
/// There is no room for a single worker.
pub fn start_workers(count: Option<u16>, output: &Output) -> anyhow::Result<()> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let wanted = count.map_or(cores, usize::from);
    let (room, error) = count_room(wanted + OTHER_THREADS);
    let workers = room.saturating_sub(OTHER_THREADS).min(wanted);
    if let Some(error) = error {
        if workers == 0 {
            return Err(no_room(&error));
        }
        output.note(format!(
            "the system has room for {workers} of {wanted} worker threads ({error}); continuing with these"
        ));
    } else if count.is_none() {
        // The workers start with the first parallel work, so that short commands do not wait for them.
        return Ok(());
    }
    rayon::ThreadPoolBuilder::new().num_threads(workers).build_global()?;
    Ok(())
}

/// Error for a system that does not permit another thread.
pub fn no_room(error: &io::Error) -> anyhow::Error {
    anyhow!(
        "the system does not start the threads that augsim needs, at least {} ({error}); raise the limits of this \
         user (`ulimit -u`, `ulimit -v`), or end other programs, and use fewer worker threads (--threads 1)",
        OTHER_THREADS + 1
    )
}

/// Number of further threads, up to `wanted`, that the system can start.
///
/// If it is less than `wanted`, the error of the first thread that did not start comes with it.
fn count_room(wanted: usize) -> (usize, Option<io::Error>) {
    let mut waiting = Vec::new();
    let mut failed = None;
    while waiting.len() < wanted && failed.is_none() {
        let (release, released) = channel::<()>();
        // The thread waits until its sender is dropped.
        match Builder::new().spawn(move || released.recv()) {
            Ok(thread) => waiting.push((release, thread)),
            Err(error) => failed = Some(error),
        }
    }
    let room = waiting.len();
    for (release, thread) in waiting {
        drop(release);
        // A thread that only waits does not panic.
        let _ = thread.join();
    }
    (room, failed)
}

#[cfg(test)]
mod tests {
    //! Contract: a few threads can be started; the error names the remedy.
    use super::*;

    #[test]
    fn counts_the_threads_that_start() {
        assert!(matches!(count_room(3), (3, None)));
        let error = no_room(&io::Error::from_raw_os_error(11)).to_string();
        assert!(error.contains("--threads 1") && error.contains("ulimit -u"), "{error}");
    }
}
