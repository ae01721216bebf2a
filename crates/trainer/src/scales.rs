//! Scales of what a net reads and of what it corrects, fitted on the training set only.

use serde::{Deserialize, Serialize};

/// The scales of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scales {
    /// Mean of each state column where single steps are corrected, of each condition where roll-outs are.
    pub mean: Vec<f64>,
    /// Standard deviation of the same.
    pub sd: Vec<f64>,
    /// Root mean square of one physics step, f_p(s) - s, of each state column; empty where roll-outs are corrected.
    pub step: Vec<f64>,
    /// Root mean square of a correction of each state column, in units of its likely size.
    pub correction: Vec<f64>,
}

/// A scale that can be divided by: what never varies has scale 1, there is nothing to scale.
pub(crate) fn positive(scale: f64, least: f64) -> f64 {
    if scale > least && scale.is_finite() { scale } else { 1.0 }
}

impl Scales {
    /// Rows of states to standard units, in place.
    pub(crate) fn standardise(&self, rows: &mut [f32]) {
        for row in rows.chunks_exact_mut(self.mean.len()) {
            for ((v, mean), sd) in row.iter_mut().zip(&self.mean).zip(&self.sd) {
                *v = ((f64::from(*v) - mean) / sd) as f32;
            }
        }
    }

    /// States `[time, S, lane]` in standard units back to units of the data, in place.
    pub(crate) fn restore(&self, values: &mut [f32], lanes: usize) {
        for (row, v) in values.chunks_exact_mut(lanes).enumerate() {
            let (mean, sd) = (self.mean[row % self.mean.len()], self.sd[row % self.mean.len()]);
            v.iter_mut().for_each(|v| *v = (mean + sd * f64::from(*v)) as f32);
        }
    }
}
