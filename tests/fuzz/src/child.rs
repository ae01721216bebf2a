//! The process that reads: one thread, a limit on memory, a watch on time. Lines on standard output tell the parent.

use crate::campaign::Campaign;
use crate::limits::MEMORY;
use crate::reader::{Files, Reader};
use crate::verdict::{Class, Verdict, kind, shortened};
use cap::Cap;
use std::alloc::System;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Counts every byte of this process and refuses beyond a limit, which aborts it.
#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

/// Exit code of a child that ended itself because an input took too long.
pub const HANG: i32 = 86;

/// Inputs between reports of the counts, so that a child that dies has told nearly all.
const REPORT_EVERY: u64 = 512;

/// When the input that is being read was begun.
static BEGUN: Mutex<Option<Instant>> = Mutex::new(None);

/// Place and message of the last panic.
static PANIC: Mutex<String> = Mutex::new(String::new());

/// Inputs of one child: `first`, `first + step`, … below `end`.
#[derive(Debug, Clone)]
pub struct Share {
    /// First input.
    pub first: u64,
    /// Distance of two.
    pub step: u64,
    /// End of the campaign.
    pub end: u64,
}

/// Counts of one reader.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Inputs that were accepted.
    pub accepted: u64,
    /// Inputs that were refused.
    pub refused: u64,
    /// Longest time for one input, ms.
    pub slowest_ms: u64,
}

/// Reads the inputs of `share` in the folder `scratch`; the first input of each kind of finding is copied below `keep`.
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
    guard(limit);
    let folder = scratch.join("input");
    let mut out = io::stdout().lock();
    let mut counts: BTreeMap<&str, Counts> = BTreeMap::new();
    let mut known = BTreeSet::new();
    let mut done = 0;
    let mut index = share.first;
    while index < share.end {
        let (reader, files) = campaign.input(index);
        std::fs::write(scratch.join("index"), format!("{index}\t{}", reader.name))?;
        files.write(&folder)?;
        let (outcome, took) = read(&reader, &reader.path(&folder, &files));
        let count = counts.entry(reader.name).or_default();
        count.slowest_ms = count.slowest_ms.max(took.as_millis() as u64);
        match outcome {
            Ok(true) => count.accepted += 1,
            Ok(false) => count.refused += 1,
            Err((class, detail)) => {
                if known.insert((class, reader.name, kind(class, &detail))) {
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

/// Reads one case of the corpus, which lies in `folder`.
///
/// # Errors
/// The folder cannot be read.
pub fn case(reader: &Reader, folder: &Path, limit: Duration) -> io::Result<()> {
    let files = Files::read(folder)?;
    guard(limit);
    let mut out = io::stdout().lock();
    match read(reader, &reader.path(folder, &files)).0 {
        Ok(accepted) => writeln!(out, "{}", if accepted { "accepted" } else { "refused" })?,
        Err((class, detail)) => writeln!(out, "finding\t{}\t{}\t0\t{detail}", class.name(), reader.name)?,
    }
    out.flush()
}

/// Folder of a finding's input below `keep`.
pub fn finding_folder(keep: &Path, class: Class, reader: &str, index: u64) -> PathBuf {
    keep.join(reader).join(format!("{}-{index}", class.name()))
}

/// Panics are noted instead of printed; a thread ends the process when an input takes longer than `limit`.
fn guard(limit: Duration) {
    std::panic::set_hook(Box::new(|info| {
        if let Ok(mut text) = PANIC.lock() {
            *text = shortened(&info.to_string());
        }
    }));
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_millis(50));
            let begun = BEGUN.lock().ok().and_then(|begun| *begun);
            if begun.is_some_and(|begun| begun.elapsed() > limit) {
                std::process::exit(HANG);
            }
        }
    });
}

/// Whether the input was accepted, or what is wrong; and how long it took.
fn read(reader: &Reader, path: &Path) -> (Result<bool, (Class, String)>, Duration) {
    let begun = Instant::now();
    watch(Some(begun));
    // Saturates where a test of the harness has taken nearly everything.
    let limit = ALLOCATOR.allocated().saturating_add(MEMORY);
    let limited = ALLOCATOR.set_limit(limit).is_ok();
    let answer = catch_unwind(AssertUnwindSafe(|| (reader.read)(path)));
    watch(None);
    let outcome = match answer {
        Ok(_) if !limited => Err((Class::Abort, "memory of earlier inputs was not given back".to_owned())),
        Ok(Verdict::Accepted) => Ok(true),
        Ok(Verdict::Refused) => Ok(false),
        Ok(Verdict::Broken(what)) => Err((Class::Broken, what)),
        Err(_) => Err((Class::Panic, PANIC.lock().map(|text| text.clone()).unwrap_or_default())),
    };
    (outcome, begun.elapsed())
}

fn watch(begun: Option<Instant>) {
    if let Ok(mut slot) = BEGUN.lock() {
        *slot = begun;
    }
}
