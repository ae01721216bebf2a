//! Child process: reads mutated files with limits on memory and time, and reports on standard output.

use crate::campaign::Campaign;
use crate::limits::MAX_MEMORY_BYTES;
use crate::reader::{Files, Reader};
use crate::verdict::{Class, Verdict, finding_key, shortened};
use cap::Cap;
use std::alloc::System;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Allocator that counts the memory of this process and aborts the process above a limit.
#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

/// Exit code of a child that ended itself because an input exceeded the time limit.
pub const HANG_EXIT_CODE: i32 = 86;

/// Number of inputs between two reports to the parent, so that little is lost if the child dies.
const REPORT_EVERY: u64 = 512;

/// Time at which reading of the current input started; `None` between inputs.
static INPUT_STARTED: Mutex<Option<Instant>> = Mutex::new(None);

/// Location and message of the last panic.
static PANIC: Mutex<String> = Mutex::new(String::new());

/// Numbers of the inputs that one child process reads: `first`, `first + step`, … below `end`.
#[derive(Debug, Clone)]
pub struct Share {
    /// Number of the first input.
    pub first: u64,
    /// Difference between the numbers of two consecutive inputs.
    pub step: u64,
    /// Number of inputs of the campaign; the last one is `end - 1`.
    pub end: u64,
}

/// Numbers of accepted and rejected inputs of one file reader, and its longest time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Number of inputs that the reader accepted.
    pub accepted: u64,
    /// Number of inputs that the reader rejected.
    pub refused: u64,
    /// Longest time in which the reader read one input, ms.
    pub slowest_ms: u64,
}

/// Reads the inputs of `share` in the folder `scratch`, and reports on standard output.
///
/// The first input of each kind of finding (defect) is copied below `keep`.
///
/// # Errors
/// The folders cannot be written.
pub fn campaign(
    campaign: &Campaign,
    share: &Share,
    scratch: &Path,
    keep: &Path,
    limit: Duration,
) -> io::Result<()> {
    install_guards(limit);
    let folder = scratch.join("input");
    let mut out = io::stdout().lock();
    let mut counts: BTreeMap<&str, Counts> = BTreeMap::new();
    let mut reported = BTreeSet::new();
    let mut done = 0;
    let mut index = share.first;
    while index < share.end {
        let (reader, files) = campaign.input(index);
        std::fs::write(scratch.join("index"), format!("{index}\t{}", reader.name))?;
        files.write(&folder)?;
        let (outcome, took) = read_guarded(&reader, &reader.path(&folder, &files));
        let count = counts.entry(reader.name).or_default();
        count.slowest_ms = count.slowest_ms.max(took.as_millis() as u64);
        match outcome {
            Ok(true) => count.accepted += 1,
            Ok(false) => count.refused += 1,
            Err((class, detail)) => {
                if reported.insert((class, reader.name, finding_key(class, &detail))) {
                    files.write(&finding_folder(keep, class, reader.name, index))?;
                    writeln!(out, "finding\t{}\t{}\t{index}\t{detail}", class.name(), reader.name)?;
                }
            }
        }
        done += 1;
        index += share.step;
        if done % REPORT_EVERY == 0 || index >= share.end {
            for (name, c) in std::mem::take(&mut counts) {
                writeln!(out, "counts\t{name}\t{}\t{}\t{}", c.accepted, c.refused, c.slowest_ms)?;
            }
            out.flush()?;
        }
    }
    Ok(())
}

/// Reads the files in `folder`, a case of the corpus, with `reader` and reports the outcome.
///
/// # Errors
/// The folder cannot be read.
pub fn case(reader: &Reader, folder: &Path, limit: Duration) -> io::Result<()> {
    let files = Files::read(folder)?;
    install_guards(limit);
    let mut out = io::stdout().lock();
    match read_guarded(reader, &reader.path(folder, &files)).0 {
        Ok(accepted) => writeln!(out, "{}", if accepted { "accepted" } else { "refused" })?,
        Err((class, detail)) => writeln!(out, "finding\t{}\t{}\t0\t{detail}", class.name(), reader.name)?,
    }
    out.flush()
}

/// Folder below `keep` to which the input of a finding (defect) is copied.
pub fn finding_folder(keep: &Path, class: Class, reader: &str, index: u64) -> PathBuf {
    keep.join(reader).join(format!("{}-{index}", class.name()))
}

/// Records panics instead of printing them, and ends the process if an input takes longer than `limit`.
fn install_guards(limit: Duration) {
    std::panic::set_hook(Box::new(|info| {
        if let Ok(mut text) = PANIC.lock() {
            *text = shortened(&info.to_string());
        }
    }));
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_millis(50));
            let started = INPUT_STARTED.lock().ok().and_then(|started| *started);
            if started.is_some_and(|started| started.elapsed() > limit) {
                std::process::exit(HANG_EXIT_CODE);
            }
        }
    });
}

/// Reads one input; returns whether it was accepted, or class and detail of the defect; and the time taken.
fn read_guarded(reader: &Reader, path: &Path) -> (Result<bool, (Class, String)>, Duration) {
    let started = Instant::now();
    set_input_start(Some(started));
    // The sum saturates in tests of the harness itself that use up nearly all memory.
    let limit = ALLOCATOR.allocated().saturating_add(MAX_MEMORY_BYTES);
    let is_limited = ALLOCATOR.set_limit(limit).is_ok();
    let answer = catch_unwind(AssertUnwindSafe(|| (reader.read)(path)));
    set_input_start(None);
    let outcome = match answer {
        Ok(_) if !is_limited => Err((Class::Abort, "memory of earlier inputs was not freed".to_owned())),
        Ok(Verdict::Accepted) => Ok(true),
        Ok(Verdict::Refused) => Ok(false),
        Ok(Verdict::Broken(what)) => Err((Class::Broken, what)),
        Err(_) => Err((Class::Panic, PANIC.lock().map(|text| text.clone()).unwrap_or_default())),
    };
    (outcome, started.elapsed())
}

/// Stores the time at which reading of the current input started; `None` after it was read.
fn set_input_start(started: Option<Instant>) {
    if let Ok(mut slot) = INPUT_STARTED.lock() {
        *slot = started;
    }
}
