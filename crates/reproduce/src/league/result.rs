//! `result.json` of the league: everything that does not depend on a clock.

use super::rows::Row;
use super::verdict::Verdict;
use serde::Serialize;

/// The file.
#[derive(Debug, Serialize)]
pub struct ResultFile {
    pub schema: &'static str,
    pub leagues: Vec<League>,
    pub seed: u64,
    pub command: String,
}

/// The league of a scenario.
#[derive(Debug, Serialize)]
pub struct League {
    /// `ball` or `push`.
    pub scenario: &'static str,
    /// Test sets, the first of the kind that was trained on.
    pub sets: Vec<String>,
    /// Training trajectories.
    pub training: usize,
    /// Iterations of every net that learns by gradients.
    pub iterations: u64,
    /// Settings tried of every class that has some.
    pub settings_tried: usize,
    /// Seeds of every trained class.
    pub seeds: u64,
    pub rows: Vec<Row>,
    /// The best classes trained on fewer and on more trajectories, scored on the first test set; empty where none are.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sizes: Vec<Row>,
    /// Models that are significantly better than others, one verdict a test set.
    pub verdicts: Vec<Verdict>,
}

impl League {
    /// Models that were trained on several sizes, best first.
    pub fn sized_models(&self) -> Vec<&str> {
        let mut models: Vec<&str> = self.sizes.iter().map(|r| r.model.as_str()).collect();
        models.dedup();
        models
    }
}
