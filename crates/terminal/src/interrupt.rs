//! Handles SIGINT, SIGTERM and SIGHUP: all work stops within two seconds without partial files.
//!
//! A thread waits for the signals. Work with a checkpoint (training) holds a [`CheckpointGuard`], asks it after
//! each iteration and writes the checkpoint. All other work, and work that does not respond in time, is
//! terminated by the thread, after it removed the temporary files and the empty folders of this process.
//! A second signal ends the process at once, unless it arrives together with the first: schedulers
//! signal each process of a job, and `sweep run` forwards the signal to its tasks.

use augsim_data::remove_unfinished_writes;
use augsim_session::folders;
use std::io::Write;
use std::sync::atomic::{AtomicI32, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Time limit for writing a checkpoint after a signal; with the cleanup it stays below two seconds.
const CHECKPOINT_TIMEOUT: Duration = Duration::from_millis(1500);

/// Time after the first signal in which another one is a copy of it, not a second request.
const DUPLICATE_SIGNAL_TIME: Duration = Duration::from_millis(300);

/// Environment variable with the process id of the parent; this process ends when the parent ends.
pub const PARENT: &str = "AUGSIM_PARENT_PROCESS";

/// Number of the first signal received by this process; 0 before.
static REQUESTED: AtomicI32 = AtomicI32::new(0);
/// Number of existing [`CheckpointGuard`]s, that is, of work that writes a checkpoint if interrupted.
static KEEPERS: AtomicUsize = AtomicUsize::new(0);

/// Guard held by work that writes a checkpoint when it is interrupted.
#[derive(Debug)]
pub struct CheckpointGuard(());

impl CheckpointGuard {
    /// Registers work that writes a checkpoint when it is interrupted.
    pub fn new() -> Self {
        KEEPERS.fetch_add(1, Ordering::SeqCst);
        CheckpointGuard(())
    }

    /// Whether a signal has asked the work to stop.
    pub fn must_stop(&self) -> bool {
        REQUESTED.load(Ordering::SeqCst) != 0
    }
}

impl Default for CheckpointGuard {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for CheckpointGuard {
    fn drop(&mut self) {
        KEEPERS.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Returns the exit code of interrupted work: 128 plus the signal number, so 130 after SIGINT.
pub fn exit_code() -> u8 {
    match REQUESTED.load(Ordering::SeqCst) {
        0 => 130,
        signal => code(signal),
    }
}

/// Ends the process as after the received signal, without a result.
pub fn end_now() -> ! {
    end_with_note("no partial files were left")
}

/// Ends the process as after the received signal, with a note on what was written.
pub fn end_with_note(note: &str) -> ! {
    end_noting(REQUESTED.load(Ordering::SeqCst).max(1), note)
}

fn code(signal: i32) -> u8 {
    u8::try_from(128 + signal).unwrap_or(u8::MAX)
}

/// Starts the thread that handles signals.
#[cfg(unix)]
pub fn install() -> anyhow::Result<()> {
    use anyhow::Context;
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    // `nohup` ignores SIGHUP so that the program outlives the terminal.
    let hangup = (!is_ignored(SIGHUP)).then_some(SIGHUP);
    let mut signals =
        Signals::new([SIGINT, SIGTERM].into_iter().chain(hangup)).context("cannot listen for signals")?;
    std::thread::Builder::new()
        .name("signals".to_owned())
        .spawn(move || {
            let mut started: Option<Instant> = None;
            for signal in signals.forever() {
                if started.is_some_and(|begun| begun.elapsed() < DUPLICATE_SIGNAL_TIME) {
                    continue;
                }
                started = started.or_else(|| Some(Instant::now()));
                let first = REQUESTED.compare_exchange(0, signal, Ordering::SeqCst, Ordering::SeqCst).is_ok();
                if !first || KEEPERS.load(Ordering::SeqCst) == 0 {
                    end(signal);
                }
                // This thread must stay free to receive a second signal, so another thread waits.
                let waiter = std::thread::Builder::new().spawn(move || {
                    std::thread::sleep(CHECKPOINT_TIMEOUT);
                    end(signal);
                });
                if waiter.is_err() {
                    end(signal);
                }
            }
        })
        .context("cannot start a thread")?;
    Ok(())
}

/// Makes the kernel end this process by SIGTERM when its parent ends, if the parent set [`PARENT`].
#[cfg(target_os = "linux")]
pub fn end_with_parent() -> anyhow::Result<()> {
    use anyhow::Context;
    use rustix::process::{Signal, getppid, set_parent_process_death_signal};

    let named = std::env::var(PARENT).ok().and_then(|number| number.parse::<i32>().ok());
    let Some(parent) = named else { return Ok(()) };
    set_parent_process_death_signal(Some(Signal::TERM))
        .context("cannot follow the process that started this one")?;
    // The parent may have ended before the call.
    if getppid().is_none_or(|now| now.as_raw_nonzero().get() != parent) {
        end(signal_hook::consts::SIGTERM);
    }
    Ok(())
}

/// Does nothing: only Linux can end a process together with its parent.
#[cfg(not(target_os = "linux"))]
pub fn end_with_parent() -> anyhow::Result<()> {
    Ok(())
}

/// Does nothing: other systems end a process at a signal by default.
#[cfg(not(unix))]
pub fn install() -> anyhow::Result<()> {
    Ok(())
}

/// Whether this process was started with the signal ignored; false if the system does not tell.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    // Bit 0 is signal 1.
    (mask >> (signal - 1)) & 1 == 1
}

/// Ends the process with the exit code of the signal, after blocking all further writes.
fn end(signal: i32) -> ! {
    end_noting(signal, "no partial files were left")
}

fn end_noting(signal: i32, note: &str) -> ! {
    let _no_more_writes = remove_unfinished_writes();
    folders::remove_empty();
    #[cfg(unix)]
    let name = signal_hook::low_level::signal_name(signal).unwrap_or("a signal");
    #[cfg(not(unix))]
    let name = "a signal";
    // Nothing can be done when standard error is closed.
    let _ = writeln!(std::io::stderr(), "augsim: stopped by {name}; {note}");
    std::process::exit(i32::from(code(signal)))
}
