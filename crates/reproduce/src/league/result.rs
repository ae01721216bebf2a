//! `result.json` of the league, without run times.

use super::rows::Row;
use super::verdict::Verdict;
use serde::Serialize;

/// Content of `result.json` of the league.
#[derive(Debug, Serialize)]
pub struct ResultFile {
    pub schema: &'static str,
    pub leagues: Vec<League>,
    pub seed: u64,
    pub command: String,
}

/// Results of the league for one scenario.
#[derive(Debug, Serialize)]
pub struct League {
    /// Name of the scenario: `ball` or `push`.
    pub scenario: &'static str,
    /// Names of the test sets; the first has the object and surface of the training set.
    pub sets: Vec<String>,
    /// Number of training trajectories of each class.
    pub training: usize,
    /// Number of training iterations of each network.
    pub iterations: u64,
    /// Number of settings that each model class tried.
    pub settings_tried: usize,
    /// Number of seeds with which each model class was trained.
    pub seeds: u64,
    pub rows: Vec<Row>,
    /// Rows of the learning curves of the best classes on the first test set; may be empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sizes: Vec<Row>,
    /// Comparison of all models with Hybrid+, one per test set.
    pub verdicts: Vec<Verdict>,
}

impl League {
    /// Returns the names of the models with learning curves, best first.
    pub fn sized_models(&self) -> Vec<&str> {
        let mut models: Vec<&str> = self.sizes.iter().map(|r| r.model.as_str()).collect();
        models.dedup();
        models
    }
}
