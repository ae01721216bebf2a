//! A task of a sweep: one run of a command and everything that determines its result.

use super::file::Value;
use super::inputs::{Input, sha256};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Number of hexadecimal digits of a task id.
///
/// With 64 bits, two of a million tasks share an id with a probability of 1 in 40 million. The plan checks
/// for duplicates.
const ID_DIGITS: usize = 16;

/// Everything that determines the result of a task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Content {
    /// Version of augsim that runs the task; other versions may give other results.
    pub augsim: String,
    /// Command that the task runs, with its positional words.
    pub command: Vec<String>,
    /// Values of the command's options, by option name.
    pub settings: BTreeMap<String, Value>,
    /// Random seed of the command.
    pub seed: u64,
    /// Input files and folders, by option name.
    pub inputs: BTreeMap<String, Input>,
}

/// A task with its id: a line of `tasks.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// Id of the task: first digits of the SHA-256 of its content.
    pub id: String,
    /// Command, options, seed and inputs that determine the result.
    #[serde(flatten)]
    pub content: Content,
}

impl Task {
    /// Makes a task with this content.
    ///
    /// # Errors
    /// The content cannot be written as JSON.
    pub fn new(content: Content) -> serde_json::Result<Self> {
        let mut id = sha256(serde_json::to_string(&content)?.as_bytes());
        id.truncate(ID_DIGITS);
        Ok(Task { id, content })
    }

    /// Returns the value of an option, or the path of an input; `None` if it is not set.
    pub fn value(&self, name: &str) -> Option<Value> {
        let Content { settings, seed, inputs, .. } = &self.content;
        if name == "seed" {
            return Some(i64::try_from(*seed).map_or_else(|_| Value::Text(seed.to_string()), Value::Integer));
        }
        let read = || inputs.get(name).map(|input| Value::Text(input.path.clone()));
        settings.get(name).cloned().or_else(read)
    }

    /// Returns the paths of the inputs by option name, as written in the sweep file.
    pub fn paths(&self) -> BTreeMap<String, String> {
        self.content.inputs.iter().map(|(name, input)| (name.clone(), input.path.clone())).collect()
    }
}
