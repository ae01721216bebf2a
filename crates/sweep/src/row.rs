//! A row of the results table: a task and its outcome.

use super::file::Value;
use serde::Serialize;
use std::collections::BTreeMap;

/// Outcome of a task of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// The task has a result, and its criterion, if any, is met.
    Done,
    /// The task has a result that does not meet the success criterion of its command (exit code 1).
    CriterionNotMet,
    /// The last attempt at the task failed.
    Failed,
    /// The task was not started or not completed.
    Missing,
}

impl State {
    /// Returns the name of the outcome in the table.
    pub fn name(self) -> &'static str {
        match self {
            State::Done => "done",
            State::CriterionNotMet => "criterion-not-met",
            State::Failed => "failed",
            State::Missing => "missing",
        }
    }
}

/// A row of the results table: a task with its outcome, settings and scores.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// Index of the task in the plan.
    pub index: usize,
    /// Id of the task.
    pub id: String,
    /// Outcome of the task.
    pub state: State,
    /// Settings of the task: values, seed and paths of inputs, by option.
    pub settings: BTreeMap<String, Value>,
    /// Scores of the task by column name.
    pub scores: BTreeMap<String, serde_json::Value>,
    /// Error message of a failed task; `None` for other tasks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl Row {
    /// Returns the score with this name; `None` if it is absent or not a number.
    pub fn number(&self, score: &str) -> Option<f64> {
        self.scores.get(score)?.as_f64()
    }

    /// Makes the row of a completed task, for tests.
    #[cfg(test)]
    pub fn done(settings: BTreeMap<String, Value>, scores: BTreeMap<String, serde_json::Value>) -> Self {
        Row { index: 0, id: String::new(), state: State::Done, settings, scores, error: None }
    }
}
