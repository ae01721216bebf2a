//! Atomic writing of files: the target is either complete or unchanged.
//!
//! The bytes are written to a temporary file in the target's folder and flushed to the disk, and the file is
//! renamed. No reader sees half a file, even where the process was killed, and a failed write keeps the old
//! file.
//!
//! A process that is asked to terminate removes its temporary files with [`remove_unfinished_writes`]; those of killed
//! processes are removed by [`remove_stale_temporaries`].

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use thiserror::Error;

/// Paths of the temporary files that this process is writing.
///
/// A temporary file is created and listed here, and renamed and removed from the list, under the lock, so the
/// list is complete whenever the lock is held.
static IN_FLIGHT: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Age above which a temporary file counts as abandoned even if its process id exists; ids are reused.
const MAX_TEMPORARY_AGE: Duration = Duration::from_secs(24 * 3600);

/// Step of [`atomic_write`] that failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WriteStep {
    /// Creating the temporary file in the target's folder failed.
    Create,
    /// Producing the bytes, or writing them to the temporary file, failed.
    Write,
    /// Flushing the temporary file to the disk failed.
    Sync,
    /// Renaming the temporary file to the target failed.
    Rename,
}

impl WriteStep {
    fn advice(self) -> &'static str {
        match self {
            WriteStep::Create => {
                "cannot create a file in its folder; check that the folder exists and is writable"
            }
            WriteStep::Write => {
                "writing failed and the target is unchanged; check the free disk space and try again"
            }
            WriteStep::Sync => "cannot flush to the disk and the target is unchanged; check the disk",
            WriteStep::Rename => {
                "cannot rename the finished file to the target; check that the target is not a folder"
            }
        }
    }
}

/// Error of [`atomic_write`]: the file could not be written and the target is unchanged.
#[derive(Debug, Error)]
#[error("{}: {} ({cause})", path.display(), step.advice())]
pub struct AtomicWriteError {
    /// Path of the target file.
    pub path: PathBuf,
    /// Step of the write that failed.
    pub step: WriteStep,
    /// Error of the operating system or of the closure that writes the content.
    pub cause: io::Error,
}

/// Writes the file `path` atomically with the content that `fill` produces.
///
/// `fill` receives a buffered writer; it returns errors of other kinds as `io::Error::other`. Where `path` is
/// a symbolic link, the file that it points to is written.
///
/// # Errors
/// [`AtomicWriteError`] with the target and the failed step; the temporary file is removed.
pub fn atomic_write<F>(path: &Path, fill: F) -> Result<(), AtomicWriteError>
where
    F: FnOnce(&mut BufWriter<File>) -> io::Result<()>,
{
    let failed = |step| move |cause| AtomicWriteError { path: path.to_owned(), step, cause };
    let target = resolve_link(path);
    let (temporary, file) = create_temporary(&target).map_err(failed(WriteStep::Create))?;
    let outcome = fill_and_sync(file, fill).and_then(|()| {
        let mut in_flight = in_flight();
        fs::rename(&temporary, &target).map_err(|e| (WriteStep::Rename, e))?;
        in_flight.remove(&temporary);
        Ok(())
    });
    if let Err((step, cause)) = outcome {
        let mut in_flight = in_flight();
        // The first error is reported; a temporary file that cannot be removed is harmless.
        let _ = fs::remove_file(&temporary);
        in_flight.remove(&temporary);
        return Err(failed(step)(cause));
    }
    sync_folder(&target);
    Ok(())
}

/// Checks that files can be created in the folder of `path`, by creating and removing one.
///
/// # Errors
/// [`AtomicWriteError`] with [`WriteStep::Create`].
pub fn check_writable(path: &Path) -> Result<(), AtomicWriteError> {
    let failed = |cause| AtomicWriteError { path: path.to_owned(), step: WriteStep::Create, cause };
    let (temporary, _) = create_temporary(&resolve_link(path)).map_err(failed)?;
    let mut in_flight = in_flight();
    in_flight.remove(&temporary);
    fs::remove_file(&temporary).map_err(failed)
}

/// Removes the temporary files of all unfinished writes of this process and blocks further writes.
///
/// No write starts, finishes or fails before the returned guard is dropped. A process that keeps the guard
/// until it exits leaves no temporary file behind.
pub fn remove_unfinished_writes() -> impl Sized {
    let mut in_flight = in_flight();
    while let Some(temporary) = in_flight.pop_first() {
        // The process is about to exit, and the next run removes files that remain.
        let _ = fs::remove_file(temporary);
    }
    in_flight
}

/// Removes temporary files that killed processes left in `folder`.
///
/// A file is removed where `is_target` accepts the name of its target and its process no longer exists or the
/// file is older than a day. Files that cannot be removed are skipped.
pub fn remove_stale_temporaries(folder: &Path, is_target: impl Fn(&str) -> bool) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let in_flight = in_flight();
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some((target, process)) = name.to_str().and_then(target_and_process) else { continue };
        let is_old = || {
            let age = entry.metadata().and_then(|m| m.modified()).ok().and_then(|m| m.elapsed().ok());
            age.is_some_and(|age| age > MAX_TEMPORARY_AGE)
        };
        // Inside a container the next process often has the same id as the one before it.
        let is_unknown = || !in_flight.iter().any(|path| path.file_name() == Some(&*name));
        let is_abandoned =
            if process == std::process::id() { is_unknown() } else { is_gone(process) || is_old() };
        if is_abandoned && is_target(target) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Parses the name of a temporary file into target name and process id; `None` for any other name.
fn target_and_process(name: &str) -> Option<(&str, u32)> {
    let middle = name.strip_prefix('.')?.strip_suffix(".tmp")?;
    let (target, numbers) = middle.rsplit_once('.')?;
    let (process, count) = numbers.split_once('-')?;
    count.parse::<u64>().ok()?;
    Some((target, process.parse().ok()?))
}

/// Whether no process has this id; `false` where the system does not list its processes.
fn is_gone(process: u32) -> bool {
    let processes = Path::new("/proc");
    processes.join("self").exists() && !processes.join(process.to_string()).exists()
}

fn in_flight() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // A panic between two file operations does not make the list wrong.
    IN_FLIGHT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the file that a symbolic link points to, because a rename onto the link would replace the link.
fn resolve_link(path: &Path) -> PathBuf {
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
    fill(&mut writer).and_then(|()| writer.flush()).map_err(|e| (WriteStep::Write, e))?;
    writer.get_ref().sync_all().map_err(|e| (WriteStep::Sync, e))
}

/// Creates a temporary file next to `path`, named with the process id and a counter.
///
/// `create_new` makes sure that no other write uses the same file.
fn create_temporary(path: &Path) -> io::Result<(PathBuf, File)> {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    let name = path
        .file_name()
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path does not name a file"))?;
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

/// Flushes the folder of a renamed file to the disk, so that the rename survives a power failure.
///
/// Where the system does not allow opening a folder, the data are on the disk and only the new name might be lost.
fn sync_folder(path: &Path) {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests {
    //! Contract: after any failure the old file is intact and no temporary file remains.
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
    fn a_failed_write_keeps_the_old_file_and_no_temporary_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.json");
        fs::write(&path, "old").unwrap();
        let error = atomic_write(&path, |w| {
            w.write_all(b"half")?;
            Err(io::Error::other("the model diverged"))
        })
        .unwrap_err();
        assert_eq!(error.step, WriteStep::Write);
        assert_eq!(
            error.to_string(),
            format!(
                "{}: writing failed and the target is unchanged; check the free disk space and try again (the \
                 model diverged)",
                path.display()
            )
        );
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["result.json"]);
    }

    #[test]
    fn a_missing_folder_fails_on_create_and_a_folder_as_target_on_rename() {
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
        let own_id = std::process::id();
        // No system assigns this process id.
        let dead = u32::MAX;
        let stale =
            [format!(".result.json.{dead}-0.tmp"), format!(".a.b.csv.{own_id}-18446744073709551615.tmp")];
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
        remove_stale_temporaries(folder.path(), |target| target == "other.json");
        assert_eq!(names(folder.path()).len(), stale.len() + kept.len());
        remove_stale_temporaries(folder.path(), |_| true);
        let mut expected = kept.to_vec();
        // Process 1 exists wherever processes are listed; elsewhere a recent file is kept as well.
        expected.sort();
        assert_eq!(names(folder.path()), expected);
    }

    #[cfg(unix)]
    #[test]
    fn writing_through_a_link_keeps_the_link_and_replaces_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        atomic_write(&link, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }
}
