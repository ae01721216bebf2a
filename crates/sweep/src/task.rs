//! A task: one run of a command and everything that determines its result.

use super::file::Value;
use super::inputs::{Input, sha256};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Number of hexadecimal digits of a task id. With 64 bits, two of a million tasks share an id with a
/// probability of 1 in 40 million. The plan checks for duplicates.
const ID_DIGITS: usize = 16;

/// Everything that determines the result of a task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Content {
    /// Version of augsim; other versions may give other results.
    pub augsim: String,
    /// Command and its positional words.
    pub command: Vec<String>,
    /// Options by name.
    pub settings: BTreeMap<String, Value>,
    /// Random seed.
    pub seed: u64,
    /// Input files and folders by option name.
    pub inputs: BTreeMap<String, Input>,
}

/// A line of `tasks.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// Task id: first digits of the SHA-256 of the content.
    pub id: String,
    /// Content of the task.
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

    /// Returns the value of an option, or the path of an input.
    pub fn value(&self, name: &str) -> Option<Value> {
        let Content { settings, seed, inputs, .. } = &self.content;
        if name == "seed" {
            return Some(i64::try_from(*seed).map_or_else(|_| Value::Text(seed.to_string()), Value::Integer));
        }
        let read = || inputs.get(name).map(|input| Value::Text(input.path.clone()));
        settings.get(name).cloned().or_else(read)
    }

    /// Returns the paths of the inputs as written in the sweep file.
    pub fn paths(&self) -> BTreeMap<String, String> {
        self.content.inputs.iter().map(|(name, input)| (name.clone(), input.path.clone())).collect()
    }
}
