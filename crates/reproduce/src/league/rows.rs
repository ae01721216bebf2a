//! Rows of the league: models on test sets.

use super::factors::{Factors, SETTINGS};
use super::measures::mean;
use augsim_trainer::Recipe;
use serde::Serialize;
use std::collections::BTreeMap;

/// A row of the table, with the score of each trajectory for intervals: mean over the seeds.
#[derive(Debug)]
pub struct Scored {
    pub row: Row,
    /// The recipe, of a model that was trained and is scored as it draws.
    pub recipe: Option<Recipe>,
    pub crps: Vec<f64>,
}

impl Scored {
    /// Mean of the deciding score.
    pub fn mean_crps(&self) -> f64 {
        mean(&self.crps)
    }
}

/// A model on a test set.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    pub model: String,
    pub set: String,
    /// Seeds that the figures are of.
    pub seeds: usize,
    /// Figures by name, with their units in it.
    pub figures: BTreeMap<String, Spread>,
    /// 95 % interval of the deciding score: bootstrap over trajectories.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crps_ci95: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parameters: Option<usize>,
    /// Training trajectories.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trained_on: Option<usize>,
    /// Settings tried on the validation part.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tried: Vec<Tried>,
    /// Processor time of a training, s: median over seeds. In `timing.json`, because it differs from run to run.
    #[serde(skip)]
    pub cpu_s: Option<f64>,
    /// Processor time of a simulated second, microseconds. In `timing.json`.
    #[serde(skip)]
    pub microseconds: Option<f64>,
}

impl Row {
    /// The factors that were chosen for it; those of the first setting where none were tried.
    pub fn factors(&self) -> Factors {
        SETTINGS[self.tried.iter().position(|tried| tried.chosen).unwrap_or(0)]
    }
}

/// A figure over seeds.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Spread {
    pub median: f64,
    pub min: f64,
    pub max: f64,
}

impl Spread {
    /// Of at least one value.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let (min, max) = (values.first().copied(), values.last().copied());
        let median = values.get((values.len().max(1) - 1) / 2).copied();
        let [median, min, max] = [median, min, max].map(|v| v.unwrap_or(f64::NAN));
        Spread { median, min, max }
    }
}

/// A setting that was tried, with its score on the validation part.
#[derive(Debug, Clone, Serialize)]
pub struct Tried {
    pub learning_rate: f64,
    /// Units of a hidden layer.
    pub hidden: usize,
    /// The deciding score.
    pub crps: f64,
    pub chosen: bool,
}
