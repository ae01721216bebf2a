//! A small file system in memory, mounted as root, that fails like a full or a read-only disk.

use anyhow::Context;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A small file system mounted on this folder; it is unmounted when dropped.
#[derive(Debug)]
pub struct TinyDisk(PathBuf);

impl TinyDisk {
    /// Mounts a file system of `room` KiB in memory on `folder`.
    ///
    /// # Errors
    /// This user or this container may not mount file systems.
    pub fn mount(folder: &Path, room: u64) -> anyhow::Result<Self> {
        let size = format!("size={room}k");
        let disk = TinyDisk(folder.to_owned());
        call(Command::new("mount").args(["-t", "tmpfs", "-o", &size, "tmpfs"]).arg(folder))?;
        Ok(disk)
    }

    /// Whether this process may mount file systems, tested on `folder`.
    pub fn can_mount(folder: &Path) -> bool {
        TinyDisk::mount(folder, 64).is_ok()
    }

    /// Enlarges the file system to 256 MiB.
    ///
    /// # Errors
    /// The file system cannot be remounted.
    pub fn grow(&self) -> anyhow::Result<()> {
        call(Command::new("mount").args(["-o", "remount,size=256m"]).arg(&self.0))
    }

    /// Makes the file system read-only.
    ///
    /// # Errors
    /// The file system cannot be remounted.
    pub fn forbid_writing(&self) -> anyhow::Result<()> {
        call(Command::new("mount").args(["-o", "remount,ro"]).arg(&self.0))
    }
}

impl Drop for TinyDisk {
    fn drop(&mut self) {
        // A lazy unmount works although a killed process may still use the disk. It may fail if the mount
        // failed.
        let _ = Command::new("umount").arg("--lazy").arg(&self.0).output();
    }
}

/// Runs a command; the error of a failed command is its standard error.
fn call(command: &mut Command) -> anyhow::Result<()> {
    let output = command.output().context("mount cannot be started")?;
    anyhow::ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr).trim());
    Ok(())
}
