//! SIGINT, SIGTERM and SIGHUP: all work stops within two seconds and leaves nothing half written.
//!
//! A thread waits for the signals. Work that has something to keep (training) holds a [`Keeper`], asks it after each
//! iteration and writes its checkpoint. All other work, and work that does not answer in time, is ended by the thread, after
//! it removed the temporary files and the empty folders that this process made. A second signal ends the process at once,
//! unless it comes with the first: a scheduler that stops a job signals each of its processes, and so does `sweep run` above a
//! task.

use augsim_data::abandon_writes;
use augsim_session::folders;
use std::io::Write;
use std::sync::atomic::{AtomicI32, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Time that work has to write its checkpoint: with the removal of temporary files it stays below two seconds.
const PATIENCE: Duration = Duration::from_millis(1500);

/// Signals that follow the first within this time are the same wish, on two ways.
const SAME_WISH: Duration = Duration::from_millis(300);

/// Variable in which a process that starts this one, and is to take it along when it is killed, gives its number.
pub const PARENT: &str = "AUGSIM_PARENT_PROCESS";

/// Number of the signal that asked to stop; 0 before that.
static REQUESTED: AtomicI32 = AtomicI32::new(0);
/// Number of [`Keeper`]s that there are.
static KEEPERS: AtomicUsize = AtomicUsize::new(0);

/// Work that writes what it has when it is asked to stop.
#[derive(Debug)]
pub struct Keeper(());

impl Keeper {
    /// Begins such work.
    pub fn new() -> Self {
        KEEPERS.fetch_add(1, Ordering::SeqCst);
        Keeper(())
    }

    /// Whether the user asked to stop.
    pub fn must_stop(&self) -> bool {
        REQUESTED.load(Ordering::SeqCst) != 0
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        KEEPERS.fetch_sub(1, Ordering::SeqCst);
    }
}

/// The exit code of work that was stopped: 128 plus the number of the signal, so 130 after SIGINT.
pub fn exit_code() -> u8 {
    match REQUESTED.load(Ordering::SeqCst) {
        0 => 130,
        signal => code(signal),
    }
}

fn code(signal: i32) -> u8 {
    u8::try_from(128 + signal).unwrap_or(u8::MAX)
}

/// Begins to listen.
#[cfg(unix)]
pub fn install() -> anyhow::Result<()> {
    use anyhow::Context;
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    // Whoever starts a program with `nohup` wants it to outlive the terminal.
    let hangup = (!is_ignored(SIGHUP)).then_some(SIGHUP);
    let mut signals =
        Signals::new([SIGINT, SIGTERM].into_iter().chain(hangup)).context("cannot listen for signals")?;
    std::thread::Builder::new()
        .name("signals".to_owned())
        .spawn(move || {
            let mut begun: Option<Instant> = None;
            for signal in signals.forever() {
                if begun.is_some_and(|begun| begun.elapsed() < SAME_WISH) {
                    continue;
                }
                begun = begun.or_else(|| Some(Instant::now()));
                let first = REQUESTED.compare_exchange(0, signal, Ordering::SeqCst, Ordering::SeqCst).is_ok();
                if !first || KEEPERS.load(Ordering::SeqCst) == 0 {
                    end(signal);
                }
                // Waiting here would make this thread deaf to the second signal.
                std::thread::spawn(move || {
                    std::thread::sleep(PATIENCE);
                    end(signal);
                });
            }
        })
        .context("cannot start a thread")?;
    Ok(())
}

/// Lets this process end with the one that started it, where that names itself in [`PARENT`]: should that be killed, the
/// kernel sends SIGTERM, and nobody computes what nobody waits for.
#[cfg(target_os = "linux")]
pub fn end_with_parent() -> anyhow::Result<()> {
    use anyhow::Context;
    use rustix::process::{Signal, getppid, set_parent_process_death_signal};

    let named = std::env::var(PARENT).ok().and_then(|number| number.parse::<i32>().ok());
    let Some(parent) = named else { return Ok(()) };
    set_parent_process_death_signal(Some(Signal::TERM))
        .context("cannot follow the process that started this one")?;
    // It may have been killed before the kernel was asked.
    if getppid().is_none_or(|now| now.as_raw_nonzero().get() != parent) {
        end(signal_hook::consts::SIGTERM);
    }
    Ok(())
}

/// Other systems do not tell.
#[cfg(not(target_os = "linux"))]
pub fn end_with_parent() -> anyhow::Result<()> {
    Ok(())
}

/// Other systems end the process themselves.
#[cfg(not(unix))]
pub fn install() -> anyhow::Result<()> {
    Ok(())
}

/// Whether this process was started with that signal ignored, where the system tells.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    // Bit 0 stands for signal 1.
    (mask >> (signal - 1)) & 1 == 1
}

/// Ends the process: its writes are abandoned and none begins any more.
#[cfg(unix)]
fn end(signal: i32) -> ! {
    let _no_more_writes = abandon_writes();
    folders::remove_empty();
    let name = signal_hook::low_level::signal_name(signal).unwrap_or("a signal");
    // Nothing can be done when standard error is closed.
    let _ = writeln!(std::io::stderr(), "augsim: stopped by {name}; nothing half written was left behind");
    std::process::exit(i32::from(code(signal)))
}
