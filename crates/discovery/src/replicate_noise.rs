//! Measurement noise of the replicates for the noise floor: no more than the residuals of the fit show.
//!
//! The noise of a record is estimated before the search, from polynomials that may not follow the motion. Then it is
//! an upper bound, and so is its correlation, to which the error of an estimated initial velocity is sensitive.

use crate::fit::{ChosenRecords, Fit};
use crate::residuals::record_residuals;

/// Measurement noise of simulated replicates, relative to the noise that was estimated before the search.
#[derive(Debug)]
pub(crate) struct ReplicateNoise {
    /// Ratio of the replicates' standard deviation to the one estimated before the search, by channel; at
    /// most 1.
    pub factors: Vec<f64>,
    /// Correlation of the replicates' noise between neighbouring samples.
    pub correlation: f64,
}

impl ReplicateNoise {
    /// Estimates the measurement noise from the residuals of `fit`, whose initial states and event offsets
    /// (nuisances) were fitted to the records of `sample`.
    pub fn of_residuals(sample: &ChosenRecords<'_>, fit: &Fit) -> Self {
        let channels = sample.data.system.schema().channels.len();
        let (mut squares, mut counts) = (vec![0.0; channels], vec![0.0; channels]);
        let (mut products, mut nuisances) = ([0.0; 2], 0.0);
        for (record, found) in sample.records().zip(record_residuals(sample, fit)) {
            nuisances += found.nuisances as f64;
            for (c, residuals) in found.residuals.iter().enumerate() {
                let scaled = |k: usize| residuals[k] * record.weight[c][k];
                let measured: Vec<usize> =
                    (0..residuals.len()).filter(|&k| residuals[k].is_finite()).collect();
                squares[c] += measured.iter().map(|&k| scaled(k).powi(2)).sum::<f64>();
                counts[c] += measured.len() as f64;
                for pair in measured.windows(2) {
                    if record.data.is_correlated_with(pair[0], pair[1]) {
                        products[0] += scaled(pair[0]) * scaled(pair[1]);
                        products[1] += 0.5 * (scaled(pair[0]).powi(2) + scaled(pair[1]).powi(2));
                    }
                }
            }
        }
        // Every nuisance takes one degree of freedom.
        let count: f64 = counts.iter().sum();
        let freedom = (count / (count - nuisances).max(1.0)).max(1.0);
        let factor = |(sum, count): (&f64, &f64)| {
            let ratio = (freedom * sum / count).sqrt();
            if ratio.is_finite() { ratio.min(1.0) } else { 1.0 }
        };
        let correlation = if products[1] > 0.0 { products[0] / products[1] } else { 0.0 };
        Self {
            factors: squares.iter().zip(&counts).map(factor).collect(),
            correlation: correlation.max(0.0).min(sample.correlation),
        }
    }
}
