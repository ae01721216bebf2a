//! The sensor that measures a state, and the prior of the initial state.

use crate::{Sequences, TrainerError};

/// Minimum standard deviation of a measurement, in the column's unit: files carry six digits.
const MIN_SD: f64 = 1e-6;

/// A sensor: which state columns it observes, and with what noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    sd: Vec<Option<f64>>,
}

impl Sensor {
    /// Creates a sensor from the standard deviation of its noise in each state column, in the column's unit.
    /// `None` marks a column that is not observed, 0 one that is exact.
    ///
    /// # Errors
    /// [`TrainerError::Setting`] if no column is observed, or a deviation is negative or not finite.
    pub fn new(sd: Vec<Option<f64>>) -> Result<Self, TrainerError> {
        let refuse = |value: String, rule| Err(TrainerError::Setting { key: "sensor", value, rule });
        if sd.iter().all(Option::is_none) {
            return refuse("no column".to_owned(), "at least one state column must be observed");
        }
        if let Some(invalid) = sd.iter().flatten().find(|sd| !(sd.is_finite() && **sd >= 0.0)) {
            return refuse(invalid.to_string(), "a standard deviation must be 0 or more");
        }
        Ok(Sensor { sd })
    }

    /// Creates a sensor that observes every column with these noise standard deviations, each 0 or more.
    pub(super) fn with_sd<const N: usize>(sd: [f64; N]) -> Self {
        Sensor { sd: sd.map(Some).to_vec() }
    }

    /// Creates a sensor that observes every column exactly.
    pub fn exact(columns: usize) -> Self {
        Sensor { sd: vec![Some(0.0); columns] }
    }

    /// Whether every column is observed exactly.
    pub fn is_exact(&self) -> bool {
        self.sd.iter().all(|sd| *sd == Some(0.0))
    }

    /// Iterates over the observed columns: index, and variance of the measurement noise.
    pub fn observed_columns(&self) -> impl Iterator<Item = (usize, f64)> {
        self.sd.iter().enumerate().filter_map(|(j, sd)| Some((j, (*sd)?.max(MIN_SD).powi(2))))
    }

    /// Returns a sensor whose noise in column `j` is at least `resolution(j)`.
    pub(super) fn with_min_sd(&self, resolution: impl Fn(usize) -> f64) -> Self {
        let sd = self.sd.iter().enumerate().map(|(j, sd)| sd.map(|sd| sd.max(resolution(j)))).collect();
        Sensor { sd }
    }

    /// Standard deviation of the measurement noise of each column; `None` where it is not observed.
    pub fn sd(&self) -> &[Option<f64>] {
        &self.sd
    }
}

/// Prior of the initial state: mean and standard deviation over the training set.
#[derive(Debug, Clone, PartialEq)]
pub struct InitialStatePrior {
    /// Mean of the initial state, `[S]`, one value per state column.
    pub mean: Vec<f64>,
    /// Standard deviation of the initial state, `[S]`, one value per state column.
    pub sd: Vec<f64>,
}

impl InitialStatePrior {
    /// Computes mean and standard deviation of the initial states of a set, column by column.
    pub fn from_training_set(train: &Sequences) -> Self {
        let (n, s) = (train.items.len().max(1) as f64, train.state_dim());
        let initial_states = || train.items.iter().map(|q| q.state(0));
        let mean: Vec<f64> = (0..s).map(|j| initial_states().map(|x| x[j]).sum::<f64>() / n).collect();
        let variance = |j: usize| initial_states().map(|x| (x[j] - mean[j]).powi(2)).sum::<f64>() / n;
        InitialStatePrior { sd: (0..s).map(|j| variance(j).sqrt()).collect(), mean }
    }
}
