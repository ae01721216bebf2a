//! Checks all files and folders that a command writes, before any work.
//!
//! An output never replaces an input. A folder with the results of another run is refused without
//! `--force`. Only regular files and folders are written.

use crate::Usage;
use crate::record::{RECORD, Record};
use augsim_data::{DataError, atomic_write, check_writable, remove_stale_temporaries};
use augsim_session::RunLock;
use augsim_session::folders;
use augsim_session::robot::DescriptionCopy;
use augsim_session::run_dir;
use augsim_session::usage::PathFault;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Argument that stands for standard input on the command line.
const STANDARD_INPUT: &str = "-";
/// File name endings of data files.
const DATA_ENDINGS: [&str; 3] = [".csv", ".csv.gz", ".npz"];

/// Checks that a data file and the files `beside` it can be written, and makes their folder.
///
/// # Errors
/// The ending is not that of a data file, an output is an input or not a regular file, or the folder is
/// not writable.
pub fn data_file(file: &Path, beside: &[PathBuf], inputs: &[&Path]) -> anyhow::Result<()> {
    for output in [file].into_iter().chain(beside.iter().map(PathBuf::as_path)) {
        check_file(output, inputs)?;
    }
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    if !DATA_ENDINGS.iter().any(|ending| name.len() > ending.len() && name.ends_with(ending)) {
        return Err(Usage::path(file, PathFault::NoDataEnding).into());
    }
    let folder = folders::parent_of(file);
    folders::make(folder)?;
    check_writable(file)?;
    // Other processes may write to the folder, so only stale temporary files of these outputs are
    // removed.
    let names: Vec<_> =
        beside.iter().map(PathBuf::as_path).chain([file]).filter_map(Path::file_name).collect();
    remove_stale_temporaries(folder, |target| names.iter().any(|name| *name == target));
    Ok(())
}

/// Checks that an output file can be written and does not replace an input.
///
/// # Errors
/// It is an input, is inside an input folder, or is not a regular file.
pub fn check_file(output: &Path, inputs: &[&Path]) -> anyhow::Result<()> {
    let refused = |fault: PathFault| Err(Usage::path(output, fault).into());
    let found = match std::fs::metadata(output) {
        Ok(found) => found,
        Err(_) if output.is_symlink() => return refused(PathFault::DanglingLink),
        // The file does not exist, or opening the folder will report the error.
        Err(_) => return Ok(()),
    };
    if found.is_dir() {
        return refused(PathFault::Folder);
    }
    if !found.is_file() {
        return refused(PathFault::Special);
    }
    for input in inputs {
        if is_same(output, input) {
            return refused(PathFault::Input { input: input.to_path_buf() });
        }
        if input.is_dir() && is_inside(output, input) {
            return refused(PathFault::FileInInput { input: input.to_path_buf() });
        }
    }
    Ok(())
}

/// Checks that no other model file is overwritten without `--force`.
///
/// # Errors
/// A different model file exists.
pub fn check_model(path: &Path, text: &str, force: bool) -> anyhow::Result<()> {
    match std::fs::read_to_string(path) {
        Ok(there) if there != text && !force => Err(Usage::path(path, PathFault::OtherModel).into()),
        _ => Ok(()),
    }
}

/// Whether two paths are the same file, also through hard or symbolic links.
fn is_same(a: &Path, b: &Path) -> bool {
    let canonical = |path: &Path| std::fs::canonicalize(path).ok();
    canonical(a).is_some_and(|a| Some(a) == canonical(b))
        || identity(a).is_some_and(|a| Some(a) == identity(b))
}

#[cfg(unix)]
fn identity(path: &Path) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    std::fs::metadata(path).ok().map(|m| (m.dev(), m.ino()))
}

#[cfg(not(unix))]
fn identity(_path: &Path) -> Option<(u64, u64)> {
    None
}

/// Whether `path`, which need not exist, is a folder or is inside it.
fn is_inside(path: &Path, folder: &Path) -> bool {
    let Ok(folder) = std::fs::canonicalize(folder) else { return false };
    path.ancestors()
        .map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p })
        .find_map(|p| std::fs::canonicalize(p).ok())
        .is_some_and(|existing| existing.starts_with(folder))
}

/// Results that a command will write into a folder: files, inputs and settings.
#[derive(Debug)]
pub struct Results<'a> {
    /// Folder that the results are written into.
    pub folder: &'a Path,
    /// Names of the result files, without `run.toml` and `timing.json`.
    pub files: &'a [&'a str],
    /// Files and folders that the command reads.
    pub inputs: &'a [&'a Path],
    /// Record of the command, settings and inputs that determine the results.
    pub record: Record,
    /// Whether the results of another run in the folder may be overwritten.
    pub force: bool,
}

/// Results folder that is locked, so that only this process writes to it.
#[derive(Debug)]
pub struct Claim {
    folder: PathBuf,
    record: Record,
    begun: Instant,
    _lock: RunLock,
}

impl Results<'_> {
    /// Locks the results folder, which is made if it does not exist.
    ///
    /// # Errors
    /// An output is an input, the folder has results of another run, another process writes there, or it
    /// is not writable.
    pub fn claim(self) -> anyhow::Result<Claim> {
        let Results { folder, files, inputs, record, force } = self;
        // A missing input is reported first: any other message about the folder would follow from it.
        for input in inputs.iter().filter(|input| **input != Path::new(STANDARD_INPUT)) {
            std::fs::metadata(input)
                .map_err(|cause| DataError::Unreadable { path: input.to_path_buf(), cause })?;
        }
        for name in files.iter().chain(&[RECORD, TIMING]) {
            check_file(&folder.join(name), inputs)?;
        }
        for input in inputs.iter().filter(|input| input.is_dir()) {
            if is_inside(folder, input) {
                let input = input.to_path_buf();
                return Err(Usage::path(folder, PathFault::FolderInInput { input }).into());
            }
        }
        let lock = RunLock::take(folder)?;
        if !force {
            check_results(folder, files, &record)?;
        }
        Ok(Claim { folder: folder.to_owned(), record, begun: Instant::now(), _lock: lock })
    }
}

/// Checks that a results folder is empty or has results of the same command on the same inputs.
///
/// An input that was edited in place is the same input.
fn check_results(folder: &Path, files: &[&str], record: &Record) -> anyhow::Result<()> {
    let refused = |fault: PathFault| Err(Usage::path(folder, fault).into());
    if let Some(there) = Record::read(folder)? {
        return match record.difference(&there, folder) {
            None => Ok(()),
            Some(difference) => refused(PathFault::OtherRun { difference }),
        };
    }
    let known = [run_dir::CONFIG, run_dir::CHECKPOINT, RESULT];
    match files.iter().chain(&known).find(|name| folder.join(name).exists()) {
        None => Ok(()),
        Some(name) => refused(PathFault::UnknownRun { file: (*name).to_owned() }),
    }
}

/// Name of the file with the results of a command.
pub const RESULT: &str = "result.json";
/// Name of the HTML report file.
pub const REPORT: &str = "report.html";
/// Name of the file with run times, the only file that differs between identical runs.
const TIMING: &str = "timing.json";

impl Claim {
    /// Returns the path of the results folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Record of the command that claimed the folder.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// Writes `run.toml` into the results folder.
    ///
    /// Call it after all input checks and before the first result.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn begin(&self) -> anyhow::Result<()> {
        self.record.write(&self.folder)
    }

    /// Writes a file into the results folder atomically and returns its path.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, name: &str, text: &str) -> anyhow::Result<PathBuf> {
        let path = self.folder.join(name);
        atomic_write(&path, |w| w.write_all(text.as_bytes()))?;
        Ok(path)
    }

    /// Writes a model file, and the description of its robot beside it if it has one; returns the path of the model file.
    ///
    /// # Errors
    /// A file cannot be written, or the text is not that of a model file.
    pub fn write_model(
        &self,
        name: &str,
        text: &str,
        description: Option<&DescriptionCopy>,
    ) -> anyhow::Result<PathBuf> {
        let Some(copy) = description else { return self.write(name, text) };
        // The description comes first, so that no model file is without it.
        if !copy.is_in_place {
            self.write(&copy.name, &copy.text)?;
        }
        self.write(name, &copy.refer(text)?)
    }

    /// Writes `timing.json`: seconds since the results folder was claimed, and `more`.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_timing(&self, more: impl Serialize) -> anyhow::Result<()> {
        #[derive(Serialize)]
        struct Timing<T: Serialize> {
            seconds: f64,
            #[serde(flatten)]
            more: T,
        }
        let timing = Timing { seconds: self.begun.elapsed().as_secs_f64(), more };
        self.write(TIMING, &serde_json::to_string_pretty(&timing)?)?;
        Ok(())
    }
}
