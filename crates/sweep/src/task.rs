//! A task: one run of a command, with everything that decides its result.

use super::file::Value;
use super::inputs::{Input, sha256};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Hexadecimal digits of a task's name: 64 bits, so that among a million tasks two have one name with odds of one to
/// 40 million. The plan looks for it all the same.
const ID_DIGITS: usize = 16;

/// Everything that decides the result of a task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Content {
    /// Version of augsim: another may give other results.
    pub augsim: String,
    /// Command and the words beside it.
    pub command: Vec<String>,
    /// Options by name.
    pub settings: BTreeMap<String, Value>,
    /// Seed of every random draw.
    pub seed: u64,
    /// Files and folders that it reads, by the name of the option.
    pub inputs: BTreeMap<String, Input>,
}

/// A line of `tasks.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// First digits of the SHA-256 of the content.
    pub id: String,
    /// The content.
    #[serde(flatten)]
    pub content: Content,
}

impl Task {
    /// A task of this content.
    ///
    /// # Errors
    /// The content cannot be written as JSON.
    pub fn new(content: Content) -> serde_json::Result<Self> {
        let mut id = sha256(serde_json::to_string(&content)?.as_bytes());
        id.truncate(ID_DIGITS);
        Ok(Task { id, content })
    }

    /// The value of an option, or the path of an input.
    pub fn value(&self, name: &str) -> Option<Value> {
        let Content { settings, seed, inputs, .. } = &self.content;
        if name == "seed" {
            return Some(i64::try_from(*seed).map_or_else(|_| Value::Text(seed.to_string()), Value::Integer));
        }
        let read = || inputs.get(name).map(|input| Value::Text(input.path.clone()));
        settings.get(name).cloned().or_else(read)
    }

    /// Paths of the inputs as they were written.
    pub fn paths(&self) -> BTreeMap<String, String> {
        self.content.inputs.iter().map(|(name, input)| (name.clone(), input.path.clone())).collect()
    }
}
