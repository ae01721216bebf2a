//! Outliers that polynomial fits miss.
//!
//! The polynomial of a short arc bends towards an outlier, and samples near events lie in no arc. Compared
//! with the calibrated model a spike is isolated between neighbours that agree, whereas the residuals of a
//! missing effect are smooth.

use crate::fit::{ChosenRecords, Fit};
use crate::record::Measured;
use crate::residuals::record_residuals;

/// Difference of a sample from the mean of its two neighbours, in standard deviations of that difference,
/// above which it is an outlier.
const SPIKE_SD: f64 = 4.5;

/// Finds isolated outliers with respect to `fit`, as `(record, channel, sample)` indices. The fit is to all
/// records of the sample.
pub(crate) fn spikes(sample: &ChosenRecords<'_>, fit: &Fit) -> Vec<(usize, usize, usize)> {
    let mut out = Vec::new();
    for (&j, fitted) in sample.chosen.iter().zip(record_residuals(sample, fit)) {
        let record = &sample.data.records[j];
        for (channel, residuals) in fitted.residuals.iter().enumerate() {
            let weight = &record.weight[channel];
            let used: Vec<usize> = (0..residuals.len()).filter(|&k| weight[k] > 0.0).collect();
            for triple in used.windows(3) {
                let &[before, k, after] = triple else { continue };
                // Residuals in units of the noise.
                let [a, x, b] = [before, k, after].map(|k| residuals[k] * weight[k]);
                let is_consecutive =
                    record.data.is_correlated_with(before, k) && record.data.is_correlated_with(k, after);
                let is_isolated = (x - 0.5 * (a + b)).abs() > SPIKE_SD * 1.5f64.sqrt();
                let neighbours_agree = (a - b).abs() < SPIKE_SD * 2f64.sqrt();
                if is_consecutive && is_isolated && neighbours_agree {
                    out.push((j, channel, k));
                }
            }
        }
    }
    out
}

/// Masks samples, given as `(record, channel, sample)`: sets their weights to 0.
pub(crate) fn mask(data: &mut Measured, samples: &[(usize, usize, usize)]) {
    for &(record, channel, k) in samples {
        data.records[record].weight[channel][k] = 0.0;
    }
}
