//! One disturbance of one command, and what must hold afterwards.

use crate::outputs::{Files, damage, difference, files, is_temporary};
use crate::run::{CHANGING, Ended, injected, run};
use crate::scene::Scene;
use crate::tiny_disk::TinyDisk;
use std::fs;
use std::path::Path;

/// Folder of the outputs within the folder of a case.
pub const OUT: &str = "out";

/// A command with the files that it writes undisturbed.
#[derive(Debug)]
pub struct Target<'a> {
    /// The program.
    pub augsim: &'a Path,
    /// The command.
    pub scene: &'a Scene,
    /// Files that an undisturbed run writes.
    pub undisturbed: Files,
}

impl Target<'_> {
    /// Kills the command at its `place`-th system call of `set` (`all`, or the changing ones), then lets it go on:
    /// the defect, if there is one.
    ///
    /// # Errors
    /// strace cannot be started, or files cannot be looked at.
    pub fn killed(&self, folder: &Path, changing: bool, place: u64) -> anyhow::Result<Option<String>> {
        let set = if changing { CHANGING } else { "all" };
        injected(self.augsim, &self.scene.arguments, folder, set, &format!("signal=SIGKILL:when={place}"))?;
        if let Some(defect) = damage(&folder.join(OUT), &self.undisturbed)? {
            return Ok(Some(defect));
        }
        self.goes_on(folder)
    }

    /// Runs the command on a file system of `room` KiB, then makes room and lets it go on.
    ///
    /// # Errors
    /// The file system cannot be mounted, or files cannot be looked at.
    pub fn full_disk(&self, folder: &Path, room: u64) -> anyhow::Result<Option<String>> {
        let disk = TinyDisk::mount(folder, room)?;
        let ended = run(self.augsim, &self.scene.arguments, folder)?;
        if ended.code == Some(0) {
            return Ok(difference(&folder.join(OUT), &self.undisturbed)?
                .map(|d| format!("it said that it was done, but {d}")));
        }
        if let Some(defect) = self.failure(folder, &ended)? {
            return Ok(Some(defect));
        }
        disk.grow()?;
        self.goes_on(folder)
    }

    /// Runs the command where nothing can be written.
    ///
    /// # Errors
    /// The file system cannot be mounted, or files cannot be looked at.
    pub fn read_only(&self, folder: &Path) -> anyhow::Result<Option<String>> {
        let disk = TinyDisk::mount(folder, 64 << 10)?;
        disk.forbid_writing()?;
        let ended = run(self.augsim, &self.scene.arguments, folder)?;
        if ended.code == Some(0) {
            return Ok(Some("it said that it was done".to_owned()));
        }
        self.failure(folder, &ended)
    }

    /// A failure is told in one sentence that names a file or folder, and leaves whole files and no temporary ones.
    fn failure(&self, folder: &Path, ended: &Ended) -> anyhow::Result<Option<String>> {
        let said = ended.stderr.trim();
        let Some(code) = ended.code else {
            return Ok(Some(format!("a signal ended it: {said}")));
        };
        if said.contains("panicked") || code == 101 {
            return Ok(Some(format!("it panicked: {said}")));
        }
        if !said.contains(OUT) {
            return Ok(Some(format!("exit code {code}, but the message names no file: {said}")));
        }
        if let Some(defect) = damage(&folder.join(OUT), &self.undisturbed)? {
            return Ok(Some(defect));
        }
        let left = files(&folder.join(OUT))?.into_keys().find(|path| is_temporary(path));
        Ok(left.map(|path| format!("the temporary file {} is left", path.display())))
    }

    fn goes_on(&self, folder: &Path) -> anyhow::Result<Option<String>> {
        // A command that was killed before it wrote anything has nothing to resume: it is begun again.
        let begun = files(&folder.join(OUT))?.keys().any(|path| !is_temporary(path));
        let arguments = if begun { &self.scene.again } else { &self.scene.arguments };
        let ended = run(self.augsim, arguments, folder)?;
        if ended.code != Some(0) {
            let code = ended.code.map_or("a signal".to_owned(), |code| format!("exit code {code}"));
            return Ok(Some(format!("it cannot go on ({code}): {}", ended.stderr.trim())));
        }
        Ok(difference(&folder.join(OUT), &self.undisturbed)?.map(|d| format!("after it went on, {d}")))
    }
}

/// An empty folder.
///
/// # Errors
/// The system's.
pub fn fresh(folder: &Path) -> anyhow::Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder)?;
    }
    Ok(fs::create_dir_all(folder)?)
}
