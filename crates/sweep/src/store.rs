//! Files in the plan folder next to the tasks: results, failures and a work folder per started task.
//!
//! Files are named by task ids, which depend on the content of the tasks only. So an existing result is
//! valid whoever made it, and a plan that is extended by more tasks keeps its results.

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

/// Stored result of a task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaskResult {
    schema: String,
    /// Id of the task that has the result.
    id: String,
    /// Whether the command's success criterion is met (exit code 0, not 1); `true` without one.
    pub criterion_met: bool,
    /// SHA-256 of `result`, by which damaged files are detected.
    sha256: String,
    /// Result document that the command wrote.
    pub result: Value,
}

/// Stored failure of the last attempt at a task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// Id of the failed task.
    pub id: String,
    /// Exit code of the command; 128 plus the signal number if it was killed.
    pub code: u8,
    /// First line of the command's error message.
    pub error: String,
}

/// Run time of a task over all attempts, s, from which the end of the sweep is estimated.
#[derive(Debug, Serialize, Deserialize)]
struct Timing {
    seconds: f64,
}

/// Result of an attempt to lock a task.
#[derive(Debug)]
pub enum TaskLock {
    /// This process holds the lock until the file and all inherited copies are closed.
    Acquired(File),
    /// Another process holds the lock.
    Busy,
}

/// Reads and writes results, failures and work files of tasks in this plan folder.
#[derive(Debug, Clone)]
pub struct Store(PathBuf);

impl Store {
    /// Makes the store of a plan folder without touching the disk.
    pub fn for_plan(plan: &Path) -> Self {
        Store(plan.to_owned())
    }

    /// Creates the folders of results, failures and work files.
    ///
    /// Empty folders are kept, because another process may be about to write there.
    ///
    /// # Errors
    /// A folder cannot be made.
    pub fn prepare(&self) -> anyhow::Result<()> {
        ["results", "failed", "work"]
            .into_iter()
            .try_for_each(|name| make_permanent_folder(&self.0.join(name)))
    }

    fn result_path(&self, id: &str) -> PathBuf {
        self.0.join("results").join(format!("{id}.json"))
    }

    fn failure_path(&self, id: &str) -> PathBuf {
        self.0.join("failed").join(format!("{id}.json"))
    }

    /// Returns the work folder of a task: its lock, its outputs, and `out`, where the command writes.
    pub fn work(&self, id: &str) -> PathBuf {
        self.0.join("work").join(id)
    }

    /// Returns the result of a task; `None` if there is none or it is damaged.
    pub fn result(&self, id: &str) -> Option<TaskResult> {
        let text = std::fs::read_to_string(self.result_path(id)).ok()?;
        let found: TaskResult = serde_json::from_str(&text).ok()?;
        let is_whole = checksum(&found.result).is_ok_and(|sum| sum == found.sha256);
        (found.schema == SCHEMA && found.id == id && is_whole).then_some(found)
    }

    /// Writes the result of a task atomically and removes the failure of an earlier attempt.
    ///
    /// # Errors
    /// The file cannot be written.
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

    /// Returns the failure of the last attempt at a task; `None` if there is none.
    pub fn failure(&self, id: &str) -> Option<Failure> {
        serde_json::from_str(&std::fs::read_to_string(self.failure_path(id)).ok()?).ok()
    }

    /// Writes the failure of a task, replacing that of an earlier attempt.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_failure(&self, failure: &Failure) -> anyhow::Result<()> {
        let text = serde_json::to_string(failure)?;
        atomic_write(&self.failure_path(&failure.id), |w| w.write_all(text.as_bytes()))?;
        Ok(())
    }

    /// Adds `took` to the run time of a task. Errors are ignored, because the time is only an estimate.
    pub fn add_seconds(&self, id: &str, took: Duration) {
        let path = self.work(id).join("timing.json");
        let before = seconds_in(&path).unwrap_or(0.0);
        if let Ok(text) = serde_json::to_string(&Timing { seconds: before + took.as_secs_f64() }) {
            let _ = std::fs::write(path, text);
        }
    }

    /// Returns the mean run time of the latest completed tasks, s; `None` if no run time is known.
    pub fn mean_seconds(&self) -> Option<f64> {
        /// Maximum number of latest tasks in the mean.
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

    /// Returns the ids of tasks with a result file.
    pub fn with_result(&self) -> BTreeSet<String> {
        names(&self.0.join("results"), ".json")
    }

    /// Returns the ids of the tasks whose last attempt failed.
    pub fn with_failure(&self) -> BTreeSet<String> {
        names(&self.0.join("failed"), ".json")
    }

    /// Returns the ids of the tasks that were started.
    pub fn started(&self) -> BTreeSet<String> {
        names(&self.0.join("work"), "")
    }

    /// Locks a task. On file systems without locks every process gets the lock.
    ///
    /// # Errors
    /// The task's folder cannot be made or written to.
    pub fn lock_task(&self, id: &str) -> anyhow::Result<TaskLock> {
        let folder = self.work(id);
        make_permanent_folder(&folder)?;
        let path = folder.join("lock");
        // Network file systems do not lock files that are open for reading only.
        let opened = File::options().create(true).truncate(false).write(true).read(true).open(&path);
        let lock = opened.with_context(|| format!("{}: cannot open it", path.display()))?;
        match lock.try_lock() {
            Err(TryLockError::WouldBlock) => Ok(TaskLock::Busy),
            Ok(()) | Err(TryLockError::Error(_)) => Ok(TaskLock::Acquired(lock)),
        }
    }

    /// Whether a process runs the task now, if the file system has locks.
    pub fn is_running(&self, id: &str) -> bool {
        let lock = File::options().read(true).open(self.work(id).join("lock"));
        // A shared lock, so that two status queries do not mistake each other for the task.
        lock.is_ok_and(|lock| matches!(lock.try_lock_shared(), Err(TryLockError::WouldBlock)))
    }
}

fn make_permanent_folder(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot make the folder", folder.display()))
}

fn checksum(result: &Value) -> serde_json::Result<String> {
    Ok(sha256(serde_json::to_string(result)?.as_bytes()))
}

fn seconds_in(path: &Path) -> Option<f64> {
    let timing: Timing = serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()?;
    Some(timing.seconds)
}

/// Returns the names of the files in `folder` that end in `end`, without this ending.
///
/// Temporary files begin with a dot and are skipped.
fn names(folder: &Path, end: &str) -> BTreeSet<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let name = |entry: std::fs::DirEntry| Some(entry.file_name().to_str()?.strip_suffix(end)?.to_owned());
    entries.filter_map(name).filter(|name| !name.starts_with('.')).collect()
}
