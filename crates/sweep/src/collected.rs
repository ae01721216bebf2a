//! Collected results of a plan: content of `result.json` and of the page.

use super::curves::Curve;
use super::row::{Row, State};
use serde::Serialize;
use std::collections::BTreeMap;

/// Content of `result.json`.
#[derive(Debug, Serialize)]
pub struct Collected {
    /// Schema name `augsim.sweep/1`.
    pub schema: &'static str,
    /// Command of all tasks.
    pub command: String,
    /// Settings with several values.
    pub crossed: Vec<String>,
    /// Columns of scores.
    pub scores: Vec<String>,
    /// SHA-256 of each input by path.
    pub inputs: BTreeMap<String, String>,
    /// All tasks in the order of the plan.
    pub tasks: Vec<Row>,
    /// Numeric scores over each crossed setting.
    pub curves: Vec<Curve>,
}

impl Collected {
    /// Returns the number of tasks in a state.
    pub fn count(&self, state: State) -> usize {
        self.tasks.iter().filter(|row| row.state == state).count()
    }
}
