//! A task and what has become of it: a row of the table.

use super::file::Value;
use serde::Serialize;
use std::collections::BTreeMap;

/// Outcome of a task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// The task has a result.
    Done,
    /// The task has a result, which does not meet the criterion that it asked for.
    CriterionNotMet,
    /// The task failed.
    Failed,
    /// The task was not run, or not to its end.
    Missing,
}

impl State {
    /// Name in the table.
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
    /// Place in the plan.
    pub index: usize,
    /// Name of the task.
    pub id: String,
    /// Outcome of the task.
    pub state: State,
    /// Settings, seed and paths of the inputs by option.
    pub settings: BTreeMap<String, Value>,
    /// Scores by column.
    pub scores: BTreeMap<String, serde_json::Value>,
    /// Why it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl Row {
    /// A score that is a number.
    pub fn number(&self, score: &str) -> Option<f64> {
        self.scores.get(score)?.as_f64()
    }

    /// A task that is done.
    #[cfg(test)]
    pub fn done(settings: BTreeMap<String, Value>, scores: BTreeMap<String, serde_json::Value>) -> Self {
        Row { index: 0, id: String::new(), state: State::Done, settings, scores, error: None }
    }
}
