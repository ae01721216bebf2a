//! Files in a plan's folder beside the tasks: results, failures, and a folder for each task that was begun.
//!
//! All names are names of tasks, which follow from what the tasks are. So a result that is there is the result, whoever made
//! it, and a plan that is made again with more tasks keeps what it has.

use super::inputs::sha256;
use super::task::Task;
use anyhow::Context;
use augsim_data::atomic_write;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs::{File, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

const SCHEMA: &str = "augsim.sweep.result/1";

/// The result of a task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaskResult {
    schema: String,
    /// Name of the task.
    id: String,
    /// Whether the criterion that the task asked for is met.
    pub criterion_met: bool,
    /// SHA-256 of `result`: a file that was damaged is no result.
    sha256: String,
    /// The document that the command wrote.
    pub result: Value,
}

/// Why a task has no result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// Name of the task.
    pub id: String,
    /// Exit code; 128 and the signal's number of a task that was killed.
    pub code: u8,
    /// First line of what it said.
    pub error: String,
}

/// Seconds that a task took, for the expected end of the others.
#[derive(Debug, Serialize, Deserialize)]
struct Timing {
    seconds: f64,
}

/// Who may run a task.
#[derive(Debug)]
pub enum Turn {
    /// We: nobody else until the file, and every copy that a child process has of it, is closed.
    Ours(File),
    /// Another process runs it.
    Theirs,
}

/// The folder of a plan.
#[derive(Debug, Clone)]
pub struct Store(PathBuf);

impl Store {
    /// Names the store in the folder of a plan; nothing is made yet.
    pub fn of(plan: &Path) -> Self {
        Store(plan.to_owned())
    }

    /// Makes the folders that results need. They stay when they are empty: another process may be about to write there.
    ///
    /// # Errors
    /// They cannot be made.
    pub fn prepare(&self) -> anyhow::Result<()> {
        ["results", "failed", "work"].into_iter().try_for_each(|name| make_to_stay(&self.0.join(name)))
    }

    fn result_path(&self, id: &str) -> PathBuf {
        self.0.join("results").join(format!("{id}.json"))
    }

    fn failure_path(&self, id: &str) -> PathBuf {
        self.0.join("failed").join(format!("{id}.json"))
    }

    /// The folder of a task: its lock, what it said, and `out`, where its command writes.
    pub fn work(&self, id: &str) -> PathBuf {
        self.0.join("work").join(id)
    }

    /// The valid result of a task, if there is one.
    pub fn result(&self, id: &str) -> Option<TaskResult> {
        let text = std::fs::read_to_string(self.result_path(id)).ok()?;
        let found: TaskResult = serde_json::from_str(&text).ok()?;
        let is_whole = checksum(&found.result).is_ok_and(|sum| sum == found.sha256);
        (found.schema == SCHEMA && found.id == id && is_whole).then_some(found)
    }

    /// Writes the result of a task, all or nothing; a failure of an earlier attempt is history.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write_result(&self, task: &Task, criterion_met: bool, result: Value) -> anyhow::Result<()> {
        let (schema, id, sha256) = (SCHEMA.to_owned(), task.id.clone(), checksum(&result)?);
        let text = serde_json::to_string(&TaskResult { schema, id, criterion_met, sha256, result })?;
        atomic_write(&self.result_path(&task.id), |w| w.write_all(text.as_bytes()))?;
        let failed = self.failure_path(&task.id);
        match std::fs::remove_file(&failed) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                Err(e).with_context(|| format!("{}: cannot remove it", failed.display()))
            }
            _ => Ok(()),
        }
    }

    /// The failure of a task, if it has one.
    pub fn failure(&self, id: &str) -> Option<Failure> {
        serde_json::from_str(&std::fs::read_to_string(self.failure_path(id)).ok()?).ok()
    }

    /// Writes down why a task failed.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write_failure(&self, failure: &Failure) -> anyhow::Result<()> {
        let text = serde_json::to_string(failure)?;
        atomic_write(&self.failure_path(&failure.id), |w| w.write_all(text.as_bytes()))?;
        Ok(())
    }

    /// Adds to the seconds that a task took. That they are lost in a power cut does no harm.
    pub fn add_seconds(&self, id: &str, took: Duration) {
        let path = self.work(id).join("timing.json");
        let before = seconds_in(&path).unwrap_or(0.0);
        if let Ok(text) = serde_json::to_string(&Timing { seconds: before + took.as_secs_f64() }) {
            let _ = std::fs::write(path, text);
        }
    }

    /// Mean seconds of the tasks that were done last.
    pub fn mean_seconds(&self) -> Option<f64> {
        /// So many tell enough.
        const LATEST: usize = 100;
        let mut done: Vec<(SystemTime, String)> = (std::fs::read_dir(self.0.join("results")).ok()?.flatten())
            .filter_map(|entry| {
                let id = entry.file_name().to_str()?.strip_suffix(".json")?.to_owned();
                Some((entry.metadata().ok()?.modified().ok()?, id))
            })
            .collect();
        done.sort();
        let took: Vec<f64> = (done.iter().rev().take(LATEST))
            .filter_map(|(_, id)| seconds_in(&self.work(id).join("timing.json")))
            .collect();
        (!took.is_empty()).then(|| took.iter().sum::<f64>() / took.len() as f64)
    }

    /// Names of tasks that have a file of results.
    pub fn with_result(&self) -> BTreeSet<String> {
        names(&self.0.join("results"), ".json")
    }

    /// Names of tasks that failed at their last attempt.
    pub fn with_failure(&self) -> BTreeSet<String> {
        names(&self.0.join("failed"), ".json")
    }

    /// Names of tasks that were begun.
    pub fn begun(&self) -> BTreeSet<String> {
        names(&self.0.join("work"), "")
    }

    /// Takes the lock of a task. Where the file system knows no locks, nobody is kept out.
    ///
    /// # Errors
    /// The task's folder cannot be made or written to.
    pub fn take_turn(&self, id: &str) -> anyhow::Result<Turn> {
        let folder = self.work(id);
        make_to_stay(&folder)?;
        let path = folder.join("lock");
        // Open for writing: network file systems lock no file that is open for reading alone.
        let opened = File::options().create(true).truncate(false).write(true).read(true).open(&path);
        let lock = opened.with_context(|| format!("{}: cannot open it", path.display()))?;
        match lock.try_lock() {
            Err(TryLockError::WouldBlock) => Ok(Turn::Theirs),
            Ok(()) | Err(TryLockError::Error(_)) => Ok(Turn::Ours(lock)),
        }
    }

    /// Whether a process runs the task just now, where the file system knows locks.
    pub fn is_running(&self, id: &str) -> bool {
        let lock = File::options().read(true).open(self.work(id).join("lock"));
        // A shared lock, so that two that look do not take each other for the task.
        lock.is_ok_and(|lock| matches!(lock.try_lock_shared(), Err(TryLockError::WouldBlock)))
    }
}

fn make_to_stay(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot make the folder", folder.display()))
}

fn checksum(result: &Value) -> serde_json::Result<String> {
    Ok(sha256(serde_json::to_string(result)?.as_bytes()))
}

fn seconds_in(path: &Path) -> Option<f64> {
    let timing: Timing = serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()?;
    Some(timing.seconds)
}

/// Names of the entries of a folder that end so, without the end; temporary files begin with a dot.
fn names(folder: &Path, end: &str) -> BTreeSet<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let name = |entry: std::fs::DirEntry| Some(entry.file_name().to_str()?.strip_suffix(end)?.to_owned());
    entries.filter_map(name).filter(|name| !name.starts_with('.')).collect()
}
