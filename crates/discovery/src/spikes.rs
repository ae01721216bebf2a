//! Outliers that the arcs alone do not show.
//!
//! A short arc's polynomial bends towards an outlier, and samples near events lie in no arc. Against the calibrated model a
//! spike stands out all the same: alone, between neighbours that agree. What a missing effect leaves is smooth there.

use crate::fit::{ChosenRecords, Fit};
use crate::record::Measured;
use crate::residuals::left;

/// Distance from the mean of the neighbours, in standard deviations of that difference, beyond which a sample is an outlier.
const SPIKE: f64 = 4.5;

/// Samples `(record, channel, index)` that stand alone against `fit`, which is on all records of the sample.
pub(crate) fn spikes(sample: &ChosenRecords<'_>, fit: &Fit) -> Vec<(usize, usize, usize)> {
    let mut out = Vec::new();
    for (&j, left) in sample.chosen.iter().zip(left(sample, fit)) {
        let record = &sample.data.records[j];
        for (channel, left) in left.residuals.iter().enumerate() {
            let weight = &record.weight[channel];
            let used: Vec<usize> = (0..left.len()).filter(|&k| weight[k] > 0.0).collect();
            for triple in used.windows(3) {
                let &[before, k, after] = triple else { continue };
                // Residuals in units of the noise.
                let [a, x, b] = [before, k, after].map(|k| left[k] * weight[k]);
                let linked = record.seen.follows(before, k) && record.seen.follows(k, after);
                let alone = (x - 0.5 * (a + b)).abs() > SPIKE * 1.5f64.sqrt();
                let agree = (a - b).abs() < SPIKE * 2f64.sqrt();
                if linked && alone && agree {
                    out.push((j, channel, k));
                }
            }
        }
    }
    out
}

/// Takes samples out of all fits.
pub(crate) fn mask(data: &mut Measured, samples: &[(usize, usize, usize)]) {
    for &(record, channel, k) in samples {
        data.records[record].weight[channel][k] = 0.0;
    }
}
