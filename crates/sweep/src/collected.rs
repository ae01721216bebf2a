//! Everything that is collected of a plan: what `result.json` holds and the page shows.

use super::curves::Curve;
use super::row::{Row, State};
use serde::Serialize;
use std::collections::BTreeMap;

/// Content of `result.json`.
#[derive(Debug, Serialize)]
pub struct Collected {
    /// `augsim.sweep/1`.
    pub schema: &'static str,
    /// The command of all tasks.
    pub command: String,
    /// Settings that differ from task to task.
    pub crossed: Vec<String>,
    /// Columns of scores.
    pub scores: Vec<String>,
    /// SHA-256 of each input, by its path.
    pub inputs: BTreeMap<String, String>,
    /// All tasks in the order of the plan.
    pub tasks: Vec<Row>,
    /// Scores that are numbers over each crossed setting.
    pub curves: Vec<Curve>,
}

impl Collected {
    /// Number of tasks in a state.
    pub fn count(&self, state: State) -> usize {
        self.tasks.iter().filter(|row| row.state == state).count()
    }
}
