//! Files that are there completely or not at all.
//!
//! The bytes go to a temporary name in the target's folder, are flushed to the disk and then renamed:
//! a reader, or a run that was killed, never sees half a file, and a failed write leaves the old one.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use thiserror::Error;

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
    /// What the system, or the closure, said.
    pub cause: io::Error,
}

/// Writes `path` through `fill`, all or nothing.
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
    let (temporary, file) = create_temporary(path).map_err(failed(WriteStep::Create))?;
    let outcome = fill_and_sync(file, fill)
        .map_err(|(step, cause)| failed(step)(cause))
        .and_then(|()| fs::rename(&temporary, path).map_err(failed(WriteStep::Rename)));
    if outcome.is_err() {
        // The first error is the one to report; a temporary file that stays is harmless.
        let _ = fs::remove_file(&temporary);
        return outcome;
    }
    sync_folder(path);
    Ok(())
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
        match OpenOptions::new().write(true).create_new(true).open(&temporary) {
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => continue,
            other => return other.map(|file| (temporary, file)),
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
    }
}
