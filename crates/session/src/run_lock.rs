//! The lock of a folder: one process at a time writes there.

use crate::usage::PathFault;
use crate::{Usage, folders};
use anyhow::Context;
use augsim_data::{check_writable, remove_stale};
use std::fs::{File, TryLockError};
use std::path::Path;

/// The right to write in a folder, until it is dropped or the process ends in whatever way.
#[derive(Debug)]
pub struct RunLock {
    /// The open folder, whose lock ends when it is closed.
    _held: Option<File>,
}

impl RunLock {
    /// Makes the folder if it is absent and locks it; removes temporary files that killed processes left there.
    ///
    /// The lock is on the folder itself, so no file of it can stay behind. Where the file system knows no locks, nobody is
    /// kept out.
    ///
    /// # Errors
    /// Another process holds the lock, or the folder cannot be made or written to.
    pub fn take(folder: &Path) -> anyhow::Result<Self> {
        folders::make(folder)?;
        let opened = open(folder).with_context(|| format!("{}: cannot open the folder", folder.display()))?;
        let lock = match opened.as_ref().map(File::try_lock) {
            Some(Err(TryLockError::WouldBlock)) => {
                return Err(Usage::path(folder, PathFault::Busy).into());
            }
            Some(Err(TryLockError::Error(_))) | None => None,
            Some(Ok(())) => opened,
        };
        if lock.is_some() {
            remove_stale(folder, |_| true);
        }
        check_writable(&folder.join("run.toml"))?;
        Ok(RunLock { _held: lock })
    }
}

#[cfg(unix)]
fn open(folder: &Path) -> std::io::Result<Option<File>> {
    File::open(folder).map(Some)
}

/// Other systems do not open folders.
#[cfg(not(unix))]
fn open(_folder: &Path) -> std::io::Result<Option<File>> {
    Ok(None)
}
