//! Rows of the league tables.

use super::factors::{Factors, SETTINGS};
use super::measures::mean;
use augsim_trainer::Recipe;
use serde::Serialize;
use std::collections::BTreeMap;

/// A row with the CRPS of each trajectory (mean over seeds), for bootstrap intervals.
#[derive(Debug)]
pub struct Scored {
    pub row: Row,
    /// Recipe of a trained model; `None` for baselines and for models whose samples are projected afterwards.
    pub recipe: Option<Recipe>,
    pub crps: Vec<f64>,
}

impl Scored {
    /// Returns the CRPS averaged over trajectories.
    pub fn mean_crps(&self) -> f64 {
        mean(&self.crps)
    }
}

/// Scores of a model on one test set: a row of the league table.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    pub model: String,
    pub set: String,
    /// Number of seeds with which the model was trained and scored.
    pub seeds: usize,
    /// Spread over seeds of each measured value, by column name, which ends in its unit.
    pub figures: BTreeMap<String, Spread>,
    /// 95 % bootstrap interval over trajectories of the mean CRPS; `None` if not computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crps_ci95: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parameters: Option<usize>,
    /// Number of training trajectories; `None` for a model without training.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trained_on: Option<usize>,
    /// Training settings that were tried on the validation part; empty if none were.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tried: Vec<Tried>,
    /// Processor time of one training in s, median over seeds; `None` without training.
    ///
    /// It is written to `timing.json`, because it differs between runs.
    #[serde(skip)]
    pub cpu_s: Option<f64>,
    /// Processor time in µs to simulate one second, written to `timing.json`; `None` without a model.
    #[serde(skip)]
    pub microseconds: Option<f64>,
}

impl Row {
    /// Returns the chosen factors of learning rate and width; those of the first setting if none were tried.
    pub fn factors(&self) -> Factors {
        SETTINGS[self.tried.iter().position(|tried| tried.chosen).unwrap_or(0)]
    }
}

/// Median, minimum and maximum of a measured value over seeds.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Spread {
    pub median: f64,
    pub min: f64,
    pub max: f64,
}

impl Spread {
    /// Computes median, minimum and maximum of at least one value.
    pub fn from_values(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let (min, max) = (values.first().copied(), values.last().copied());
        let median = values.get((values.len().max(1) - 1) / 2).copied();
        let [median, min, max] = [median, min, max].map(|v| v.unwrap_or(f64::NAN));
        Spread { median, min, max }
    }
}

/// A training setting that was tried, with its score on the validation part.
#[derive(Debug, Clone, Serialize)]
pub struct Tried {
    pub learning_rate: f64,
    /// Width of a hidden layer of the network.
    pub hidden: usize,
    /// CRPS on the validation part, averaged over trajectories.
    pub crps: f64,
    pub chosen: bool,
}
