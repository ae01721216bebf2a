//! What an experiment with balls comes to.

use super::rows::Row;
use augsim_trainer::Forecaster;
use augsim_trainer::score::Score;
use serde::Serialize;
use std::collections::BTreeMap;

/// What `result.json` holds.
#[derive(Debug, Serialize)]
pub struct ResultFile {
    /// `augsim.reproduce/1`.
    pub schema: &'static str,
    /// `ball`.
    pub scenario: &'static str,
    /// Test set.
    pub test_set: String,
    /// Trajectories in it.
    pub test_trajectories: usize,
    /// The table.
    pub rows: Vec<Row>,
    /// Iterations, by model.
    pub iterations: BTreeMap<String, u64>,
    /// Seed.
    pub seed: u64,
}

/// A scored model, for the table and the figures.
pub struct Scored<'a> {
    /// The predictor.
    pub model: &'a dyn Forecaster,
    /// Its forecast scores.
    pub score: Score,
}
