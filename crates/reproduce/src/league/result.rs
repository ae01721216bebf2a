//! `result.json` of the league, without run times.

use super::rows::Row;
use super::verdict::Verdict;
use serde::Serialize;

/// Content of `result.json`.
#[derive(Debug, Serialize)]
pub struct ResultFile {
    pub schema: &'static str,
    pub leagues: Vec<League>,
    pub seed: u64,
    pub command: String,
}

/// Results of a scenario.
#[derive(Debug, Serialize)]
pub struct League {
    /// `ball` or `push`.
    pub scenario: &'static str,
    /// Names of the test sets; the first is of the training kind.
    pub sets: Vec<String>,
    /// Number of training trajectories.
    pub training: usize,
    /// Number of training iterations of each network.
    pub iterations: u64,
    /// Number of settings that each class tried.
    pub settings_tried: usize,
    /// Number of seeds of each trained class.
    pub seeds: u64,
    pub rows: Vec<Row>,
    /// Learning curves of the best classes on the first test set; may be empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sizes: Vec<Row>,
    /// Verdicts, one per test set.
    pub verdicts: Vec<Verdict>,
}

impl League {
    /// Returns the models with learning curves, best first.
    pub fn sized_models(&self) -> Vec<&str> {
        let mut models: Vec<&str> = self.sizes.iter().map(|r| r.model.as_str()).collect();
        models.dedup();
        models
    }
}
