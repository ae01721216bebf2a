//! Collected results of a plan: content of `result.json` and of the report page.

use super::curves::Curve;
use super::row::{Row, State};
use serde::Serialize;
use std::collections::BTreeMap;

/// Collected results of all tasks of a plan: content of `result.json`.
#[derive(Debug, Serialize)]
pub struct Collected {
    /// Name and version of the file format: `augsim.sweep/1`.
    pub schema: &'static str,
    /// Command that all tasks run, such as `reproduce push`.
    pub command: String,
    /// Names of the settings that have several values in the sweep.
    pub crossed: Vec<String>,
    /// Names of the score columns.
    pub scores: Vec<String>,
    /// SHA-256 of each input file or folder, by path.
    pub inputs: BTreeMap<String, String>,
    /// Settings, state and scores of all tasks, in the order of the plan.
    pub tasks: Vec<Row>,
    /// Means of each numeric score over each setting with several values.
    pub curves: Vec<Curve>,
}

impl Collected {
    /// Returns the number of tasks with this outcome.
    pub fn count(&self, state: State) -> usize {
        self.tasks.iter().filter(|row| row.state == state).count()
    }
}
