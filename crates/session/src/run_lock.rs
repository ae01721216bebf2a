//! Lock of a folder, so that only one process at a time writes in it.

use crate::usage::PathFault;
use crate::{Usage, folders};
use anyhow::Context;
use augsim_data::{check_writable, remove_stale_temporaries};
use std::fs::{File, TryLockError};
use std::path::Path;

/// An exclusive lock on a folder, released when it is dropped or the process ends.
#[derive(Debug)]
pub struct RunLock {
    /// The open folder, whose closing releases the lock; `None` where folders cannot be locked.
    _held: Option<File>,
}

impl RunLock {
    /// Creates a folder if it is absent, locks it, and removes temporary files of killed processes.
    ///
    /// The lock is on the folder itself, so no lock file can stay behind. On file systems without locks
    /// nothing is locked.
    ///
    /// # Errors
    /// Another process holds the lock, or the folder cannot be created or written.
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
            remove_stale_temporaries(folder, |_| true);
        }
        check_writable(&folder.join("run.toml"))?;
        Ok(RunLock { _held: lock })
    }
}

#[cfg(unix)]
fn open(folder: &Path) -> std::io::Result<Option<File>> {
    File::open(folder).map(Some)
}

/// Opens no folder: other operating systems cannot open folders as files.
#[cfg(not(unix))]
fn open(_folder: &Path) -> std::io::Result<Option<File>> {
    Ok(None)
}
