//! Rows of the league tables.

use super::factors::{Factors, SETTINGS};
use super::measures::mean;
use augsim_trainer::Recipe;
use serde::Serialize;
use std::collections::BTreeMap;

/// A row with the CRPS of each trajectory (mean over seeds) for bootstrap intervals.
#[derive(Debug)]
pub struct Scored {
    pub row: Row,
    /// Recipe of a trained model with unchanged samples.
    pub recipe: Option<Recipe>,
    pub crps: Vec<f64>,
}

impl Scored {
    /// Returns the mean CRPS.
    pub fn mean_crps(&self) -> f64 {
        mean(&self.crps)
    }
}

/// Scores of a model on a test set.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    pub model: String,
    pub set: String,
    /// Number of seeds.
    pub seeds: usize,
    /// Measures by name; names end in their unit.
    pub figures: BTreeMap<String, Spread>,
    /// 95 % bootstrap interval of the mean CRPS over trajectories.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crps_ci95: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parameters: Option<usize>,
    /// Number of training trajectories.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trained_on: Option<usize>,
    /// Settings tried on the validation part.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tried: Vec<Tried>,
    /// Processor time of a training in s, median over seeds. Written to `timing.json`, because it
    /// differs between runs.
    #[serde(skip)]
    pub cpu_s: Option<f64>,
    /// Processor time of a simulated second in µs. Written to `timing.json`.
    #[serde(skip)]
    pub microseconds: Option<f64>,
}

impl Row {
    /// Returns the chosen factors; those of the first setting if none were tried.
    pub fn factors(&self) -> Factors {
        SETTINGS[self.tried.iter().position(|tried| tried.chosen).unwrap_or(0)]
    }
}

/// Statistics of a measure over seeds.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Spread {
    pub median: f64,
    pub min: f64,
    pub max: f64,
}

impl Spread {
    /// Computes the statistics of at least one value.
    pub fn from_values(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let (min, max) = (values.first().copied(), values.last().copied());
        let median = values.get((values.len().max(1) - 1) / 2).copied();
        let [median, min, max] = [median, min, max].map(|v| v.unwrap_or(f64::NAN));
        Spread { median, min, max }
    }
}

/// A tried setting with its score on the validation part.
#[derive(Debug, Clone, Serialize)]
pub struct Tried {
    pub learning_rate: f64,
    /// Width of a hidden layer.
    pub hidden: usize,
    /// Mean CRPS.
    pub crps: f64,
    pub chosen: bool,
}
