//! A task and its outcome: a row of the table.

use super::file::Value;
use serde::Serialize;
use std::collections::BTreeMap;

/// Outcome of a task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// The task has a result.
    Done,
    /// The task has a result that does not meet its criterion.
    CriterionNotMet,
    /// The task failed.
    Failed,
    /// The task was not started or not completed.
    Missing,
}

impl State {
    /// Returns the name in the table.
    pub fn name(self) -> &'static str {
        match self {
            State::Done => "done",
            State::CriterionNotMet => "criterion-not-met",
            State::Failed => "failed",
            State::Missing => "missing",
        }
    }
}

/// A task and its scores.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// Index in the plan.
    pub index: usize,
    /// Id of the task.
    pub id: String,
    /// Outcome of the task.
    pub state: State,
    /// Settings, seed and paths of the inputs by option.
    pub settings: BTreeMap<String, Value>,
    /// Scores by column.
    pub scores: BTreeMap<String, serde_json::Value>,
    /// Error message of a failed task.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl Row {
    /// Returns a numeric score.
    pub fn number(&self, score: &str) -> Option<f64> {
        self.scores.get(score)?.as_f64()
    }

    /// Makes a completed task.
    #[cfg(test)]
    pub fn done(settings: BTreeMap<String, Value>, scores: BTreeMap<String, serde_json::Value>) -> Self {
        Row { index: 0, id: String::new(), state: State::Done, settings, scores, error: None }
    }
}
