//! A file system of a few KiB in memory, which root may mount: a full disk and a read-only one that are real.

use anyhow::Context;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Unmounted when dropped.
#[derive(Debug)]
pub struct TinyDisk(PathBuf);

impl TinyDisk {
    /// Mounts a file system of `room` KiB on `folder`.
    ///
    /// # Errors
    /// This user, or this container, may not mount.
    pub fn mount(folder: &Path, room: u64) -> anyhow::Result<Self> {
        let size = format!("size={room}k");
        let disk = TinyDisk(folder.to_owned());
        call(Command::new("mount").args(["-t", "tmpfs", "-o", &size, "tmpfs"]).arg(folder))?;
        Ok(disk)
    }

    /// Whether this process may mount, tried on `folder`.
    pub fn is_possible(folder: &Path) -> bool {
        TinyDisk::mount(folder, 64).is_ok()
    }

    /// Gives it plenty of room.
    ///
    /// # Errors
    /// As [`TinyDisk::mount`].
    pub fn grow(&self) -> anyhow::Result<()> {
        call(Command::new("mount").args(["-o", "remount,size=256m"]).arg(&self.0))
    }

    /// Makes it read-only.
    ///
    /// # Errors
    /// As [`TinyDisk::mount`].
    pub fn forbid_writing(&self) -> anyhow::Result<()> {
        call(Command::new("mount").args(["-o", "remount,ro"]).arg(&self.0))
    }
}

impl Drop for TinyDisk {
    fn drop(&mut self) {
        // Lazily, so that a process that has just been killed does not keep it; a mount that failed is no mount.
        let _ = Command::new("umount").arg("--lazy").arg(&self.0).output();
    }
}

fn call(command: &mut Command) -> anyhow::Result<()> {
    let output = command.output().context("mount: cannot be started")?;
    anyhow::ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr).trim());
    Ok(())
}
