//! One fault injected into one command of `augsim`, and the check of the files that remain.

use crate::outputs::{Files, damage, difference, files, is_temporary};
use crate::run::{CHANGING, Ended, injected, run};
use crate::scene::Scene;
use crate::tiny_disk::TinyDisk;
use std::fs;
use std::path::Path;

/// Name of the folder, within the folder of a test case, to which the command writes its output.
pub const OUT: &str = "out";

/// A command under test, with the files that it writes when no fault is injected.
#[derive(Debug)]
pub struct Target<'a> {
    /// The program `augsim`.
    pub augsim: &'a Path,
    /// The command under test.
    pub scene: &'a Scene,
    /// Files that an undisturbed run writes.
    pub undisturbed: Files,
}

impl Target<'_> {
    /// Kills the command at its `place`-th system call and resumes it; describes the defect, if any.
    ///
    /// Counts only the calls in [`CHANGING`] if `changing`, else all calls.
    ///
    /// # Errors
    /// strace cannot be started, or files cannot be read.
    pub fn killed(&self, folder: &Path, changing: bool, place: u64) -> anyhow::Result<Option<String>> {
        let set = if changing { CHANGING } else { "all" };
        injected(self.augsim, &self.scene.arguments, folder, set, &format!("signal=SIGKILL:when={place}"))?;
        if let Some(defect) = damage(&folder.join(OUT), &self.undisturbed)? {
            return Ok(Some(defect));
        }
        self.resume(folder)
    }

    /// Runs the command on a file system of `room` KiB, then enlarges it and resumes the command.
    ///
    /// Returns a description of the defect, or `None`.
    ///
    /// # Errors
    /// The file system cannot be mounted, or files cannot be read.
    pub fn full_disk(&self, folder: &Path, room: u64) -> anyhow::Result<Option<String>> {
        let disk = TinyDisk::mount(folder, room)?;
        let ended = run(self.augsim, &self.scene.arguments, folder)?;
        if ended.code == Some(0) {
            return Ok(difference(&folder.join(OUT), &self.undisturbed)?
                .map(|d| format!("it reported success, but {d}")));
        }
        if let Some(defect) = self.check_failure(folder, &ended)? {
            return Ok(Some(defect));
        }
        disk.grow()?;
        self.resume(folder)
    }

    /// Runs the command on a read-only file system; returns a description of the defect, or `None`.
    ///
    /// # Errors
    /// The file system cannot be mounted, or files cannot be read.
    pub fn read_only(&self, folder: &Path) -> anyhow::Result<Option<String>> {
        let disk = TinyDisk::mount(folder, 64 << 10)?;
        disk.forbid_writing()?;
        let ended = run(self.augsim, &self.scene.arguments, folder)?;
        if ended.code == Some(0) {
            return Ok(Some("it reported success".to_owned()));
        }
        self.check_failure(folder, &ended)
    }

    /// Checks a failed command; returns a description of the defect, or `None`.
    ///
    /// The message must name a file or folder, and no damaged or temporary file may remain.
    fn check_failure(&self, folder: &Path, ended: &Ended) -> anyhow::Result<Option<String>> {
        let message = ended.stderr.trim();
        let Some(code) = ended.code else {
            return Ok(Some(format!("it was ended by a signal: {message}")));
        };
        if message.contains("panicked") || code == 101 {
            return Ok(Some(format!("it panicked: {message}")));
        }
        if !message.contains(OUT) {
            return Ok(Some(format!("exit code {code}, but the message names no file: {message}")));
        }
        if let Some(defect) = damage(&folder.join(OUT), &self.undisturbed)? {
            return Ok(Some(defect));
        }
        let temporary = files(&folder.join(OUT))?.into_keys().find(|path| is_temporary(path));
        Ok(temporary.map(|path| format!("the temporary file {} remains", path.display())))
    }

    /// Repeats or resumes the command, which must then write the files of an undisturbed run.
    ///
    /// Returns a description of the defect, or `None`.
    fn resume(&self, folder: &Path) -> anyhow::Result<Option<String>> {
        // A command that was killed before it wrote anything cannot be resumed, so it is started again.
        let has_output = files(&folder.join(OUT))?.keys().any(|path| !is_temporary(path));
        let arguments = if has_output { &self.scene.again } else { &self.scene.arguments };
        let ended = run(self.augsim, arguments, folder)?;
        if ended.code != Some(0) {
            let code = ended.code.map_or("a signal".to_owned(), |code| format!("exit code {code}"));
            return Ok(Some(format!("it cannot be resumed ({code}): {}", ended.stderr.trim())));
        }
        Ok(difference(&folder.join(OUT), &self.undisturbed)?.map(|d| format!("after it was resumed, {d}")))
    }
}

/// Creates the folder if it does not exist, and deletes its contents.
///
/// # Errors
/// The folder cannot be written.
pub fn empty_folder(folder: &Path) -> anyhow::Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder)?;
    }
    Ok(fs::create_dir_all(folder)?)
}
