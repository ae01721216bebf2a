//! Files that are there completely or not at all.
//!
//! The bytes go to a temporary name in the target's folder, are flushed to the disk and then renamed:
//! a reader, or a run that was killed, never sees half a file, and a failed write leaves the old one.
//!
//! A process that is told to end removes what it was about to write with [`abandon_writes`]; what a killed one left
//! behind is removed by [`remove_stale`].

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use thiserror::Error;

/// Temporary files that this process is writing. Creating one and its entry here, and renaming one and taking the entry
/// away, happen under the lock: whoever holds it knows every temporary file that there is.
static IN_FLIGHT: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Age from which a temporary file belongs to nobody, even if a process has the number of the one that made it: numbers are
/// used again.
const STALE: Duration = Duration::from_secs(24 * 3600);

/// Step of [`atomic_write`] that failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WriteStep {
    /// Making the temporary file in the target's folder.
    Create,
    /// Producing or writing the bytes.
    Fill,
    /// Flushing to the disk.
    Sync,
    /// Renaming to the target.
    Rename,
}

impl WriteStep {
    fn advice(self) -> &'static str {
        match self {
            WriteStep::Create => {
                "cannot create a file in its folder; check that the folder exists and may be written"
            }
            WriteStep::Fill => "writing failed; nothing was kept, free some space and try again",
            WriteStep::Sync => "cannot flush to the disk; nothing was kept, check the disk",
            WriteStep::Rename => "cannot put the finished file in place; check that the target is no folder",
        }
    }
}

/// A file that could not be written; the target is as it was before.
#[derive(Debug, Error)]
#[error("{}: {} ({cause})", path.display(), step.advice())]
pub struct AtomicWriteError {
    /// Target.
    pub path: PathBuf,
    /// Step that failed.
    pub step: WriteStep,
    /// Error of the system, or of the closure.
    pub cause: io::Error,
}

/// Writes `path` through `fill`, all or nothing. Where `path` is a link, the file that it leads to is written.
///
/// `fill` receives a buffered writer; errors of other kinds travel as `io::Error::other`.
///
/// # Errors
/// [`AtomicWriteError`] naming the target and the step; the temporary file is removed.
pub fn atomic_write<F>(path: &Path, fill: F) -> Result<(), AtomicWriteError>
where
    F: FnOnce(&mut BufWriter<File>) -> io::Result<()>,
{
    let failed = |step| move |cause| AtomicWriteError { path: path.to_owned(), step, cause };
    let target = followed(path);
    let (temporary, file) = create_temporary(&target).map_err(failed(WriteStep::Create))?;
    let outcome = fill_and_sync(file, fill).and_then(|()| {
        let mut in_flight = in_flight();
        fs::rename(&temporary, &target).map_err(|e| (WriteStep::Rename, e))?;
        in_flight.remove(&temporary);
        Ok(())
    });
    if let Err((step, cause)) = outcome {
        let mut in_flight = in_flight();
        // The first error is the one to report; a temporary file that stays is harmless.
        let _ = fs::remove_file(&temporary);
        in_flight.remove(&temporary);
        return Err(failed(step)(cause));
    }
    sync_folder(&target);
    Ok(())
}

/// Checks that files can be made in the folder of `path`, by making a temporary one and removing it.
///
/// # Errors
/// [`AtomicWriteError`] with [`WriteStep::Create`].
pub fn check_writable(path: &Path) -> Result<(), AtomicWriteError> {
    let failed = |cause| AtomicWriteError { path: path.to_owned(), step: WriteStep::Create, cause };
    let (temporary, _) = create_temporary(&followed(path)).map_err(failed)?;
    let mut in_flight = in_flight();
    in_flight.remove(&temporary);
    fs::remove_file(&temporary).map_err(failed)
}

/// Removes the temporary files of all writes of this process that have not ended. None ends, fails or begins until the
/// returned guard is dropped, so a process that keeps it until it exits leaves nothing half written.
pub fn abandon_writes() -> impl Sized {
    let mut in_flight = in_flight();
    while let Some(temporary) = in_flight.pop_first() {
        // The process is about to end, and the next run removes what stays.
        let _ = fs::remove_file(temporary);
    }
    in_flight
}

/// Removes temporary files from `folder` that killed processes left behind: those whose target's name is `wanted` and whose
/// process is gone, or that are older than a day. Files that cannot be removed stay.
pub fn remove_stale(folder: &Path, wanted: impl Fn(&str) -> bool) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let in_flight = in_flight();
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some((target, process)) = name.to_str().and_then(maker) else { continue };
        let old = || {
            let age = entry.metadata().and_then(|m| m.modified()).ok().and_then(|m| m.elapsed().ok());
            age.is_some_and(|age| age > STALE)
        };
        // Inside a container the next process often has the number of the one before it.
        let ours = || !in_flight.iter().any(|path| path.file_name() == Some(&*name));
        let abandoned = if process == std::process::id() { ours() } else { is_gone(process) || old() };
        if abandoned && wanted(target) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Target and process of a temporary file of this name; `None` for any other name.
fn maker(name: &str) -> Option<(&str, u32)> {
    let middle = name.strip_prefix('.')?.strip_suffix(".tmp")?;
    let (target, numbers) = middle.rsplit_once('.')?;
    let (process, count) = numbers.split_once('-')?;
    count.parse::<u64>().ok()?;
    Some((target, process.parse().ok()?))
}

/// Whether no process has this number, where the system tells.
fn is_gone(process: u32) -> bool {
    let processes = Path::new("/proc");
    processes.join("self").exists() && !processes.join(process.to_string()).exists()
}

fn in_flight() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // A panic between two file operations leaves the list as true as it was.
    IN_FLIGHT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The file that a link leads to; a rename onto the link itself would replace the link.
fn followed(path: &Path) -> PathBuf {
    match fs::symlink_metadata(path) {
        Ok(found) if found.is_symlink() => fs::canonicalize(path).unwrap_or_else(|_| path.to_owned()),
        _ => path.to_owned(),
    }
}

fn fill_and_sync<F>(file: File, fill: F) -> Result<(), (WriteStep, io::Error)>
where
    F: FnOnce(&mut BufWriter<File>) -> io::Result<()>,
{
    let mut writer = BufWriter::new(file);
    fill(&mut writer).and_then(|()| writer.flush()).map_err(|e| (WriteStep::Fill, e))?;
    writer.get_ref().sync_all().map_err(|e| (WriteStep::Sync, e))
}

/// A name that no other write of this or another process uses: process id and a counter, and
/// `create_new` settles the rest.
fn create_temporary(path: &Path) -> io::Result<(PathBuf, File)> {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    let name = path
        .file_name()
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path names no file"))?;
    loop {
        let mut hidden = OsString::from(".");
        hidden.push(name);
        hidden.push(format!(".{}-{}.tmp", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed)));
        let temporary = path.with_file_name(hidden);
        let mut in_flight = in_flight();
        match OpenOptions::new().write(true).create_new(true).open(&temporary) {
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => continue,
            Err(e) => return Err(e),
            Ok(file) => {
                in_flight.insert(temporary.clone());
                return Ok((temporary, file));
            }
        }
    }
}

/// Makes the rename itself durable where the system allows opening a folder; elsewhere the data is
/// safe already and only the new name might be lost in a power cut.
fn sync_folder(path: &Path) {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests {
    //! Contract: after any failure the old file is intact and no temporary one stays behind.
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_finished_write_replaces_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.json");
        fs::write(&path, "old and longer").unwrap();
        atomic_write(&path, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["result.json"]);
    }

    #[test]
    fn a_failed_write_keeps_the_old_file_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.json");
        fs::write(&path, "old").unwrap();
        let error = atomic_write(&path, |w| {
            w.write_all(b"half")?;
            Err(io::Error::other("the model diverged"))
        })
        .unwrap_err();
        assert_eq!(error.step, WriteStep::Fill);
        assert_eq!(
            error.to_string(),
            format!(
                "{}: writing failed; nothing was kept, free some space and try again (the model \
                 diverged)",
                path.display()
            )
        );
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["result.json"]);
    }

    #[test]
    fn a_missing_folder_and_a_folder_as_target_are_reported_as_such() {
        let folder = tempfile::tempdir().unwrap();
        let nowhere = atomic_write(&folder.path().join("no/such"), |_| Ok(())).unwrap_err();
        assert_eq!(nowhere.step, WriteStep::Create);
        let target = folder.path().join("run");
        fs::create_dir(&target).unwrap();
        let occupied = atomic_write(&target, |_| Ok(())).unwrap_err();
        assert_eq!(occupied.step, WriteStep::Rename);
        assert_eq!(names(folder.path()), ["run"]);
        assert_eq!(check_writable(&folder.path().join("no/such")).unwrap_err().step, WriteStep::Create);
        check_writable(&folder.path().join("new")).unwrap();
        assert_eq!(names(folder.path()), ["run"]);
    }

    #[test]
    fn temporary_files_of_dead_processes_are_removed_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let own = std::process::id();
        // No system gives a process this number.
        let dead = u32::MAX;
        let stale =
            [format!(".result.json.{dead}-0.tmp"), format!(".a.b.csv.{own}-18446744073709551615.tmp")];
        let kept = [
            ".result.json.1-0.tmp".to_owned(),
            format!("result.json.{dead}-0.tmp"),
            format!(".result.json.{dead}.tmp"),
            ".notes.tmp".to_owned(),
            "result.json".to_owned(),
        ];
        for name in stale.iter().chain(&kept) {
            fs::write(folder.path().join(name), "x").unwrap();
        }
        remove_stale(folder.path(), |target| target == "other.json");
        assert_eq!(names(folder.path()).len(), stale.len() + kept.len());
        remove_stale(folder.path(), |_| true);
        let mut expected = kept.to_vec();
        // Process 1 is alive wherever processes are listed; elsewhere a young file stays as well.
        expected.sort();
        assert_eq!(names(folder.path()), expected);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_its_file_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        atomic_write(&link, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }
}
