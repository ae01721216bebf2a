//! Normalisation scales of a net's inputs and corrections, fitted on the training set only.

use serde::{Deserialize, Serialize};

/// Normalisation scales of a training run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scales {
    /// Mean of each state column (step correction) or of each condition (roll-out correction).
    pub mean: Vec<f64>,
    /// Standard deviation of each quantity in `mean`.
    pub sd: Vec<f64>,
    /// Root mean square of one physics step, f_p(s) - s, per state column; empty for roll-out correction.
    pub step: Vec<f64>,
    /// Root mean square correction of each state column, relative to the physics step (`steps.rs`).
    pub correction: Vec<f64>,
}

/// Returns `scale`, or 1 if `scale` is not finite or not above `least`.
///
/// Constant columns can therefore be divided by their scale.
pub(crate) fn positive(scale: f64, least: f64) -> f64 {
    if scale > least && scale.is_finite() { scale } else { 1.0 }
}

impl Scales {
    /// Converts rows of states to standard units (zero mean, unit deviation), in place.
    pub(crate) fn standardise(&self, rows: &mut [f32]) {
        for row in rows.chunks_exact_mut(self.mean.len()) {
            for ((v, mean), sd) in row.iter_mut().zip(&self.mean).zip(&self.sd) {
                *v = ((f64::from(*v) - mean) / sd) as f32;
            }
        }
    }

    /// Converts states `[time, S, lane]` from standard units to the units of the data, in place.
    pub(crate) fn restore(&self, values: &mut [f32], lanes: usize) {
        for (row, v) in values.chunks_exact_mut(lanes).enumerate() {
            let (mean, sd) = (self.mean[row % self.mean.len()], self.sd[row % self.mean.len()]);
            v.iter_mut().for_each(|v| *v = (mean + sd * f64::from(*v)) as f32);
        }
    }
}
