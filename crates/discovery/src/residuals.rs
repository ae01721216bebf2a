//! What a fit leaves, sample by sample.

use crate::evaluate::{Lanes, Point};
use crate::fit::{Fit, Sample};

/// Whitened residuals of one record at a fit, with the whitened position in time of each, channel by channel, arc by arc.
pub(crate) fn residuals(sample: &Sample<'_>, fit: &Fit, i: usize) -> Vec<Vec<f64>> {
    let h = &fit.hypothesis;
    let record = &sample.data.records[sample.chosen[i]];
    let lanes = Lanes::new(h, record, &[]);
    let point = Point::new(h, &*h.system, &lanes, record, &fit.theta, &fit.nuisance[i]);
    let run = point.plain(&lanes, record);
    (0..record.seen.values.len())
        .map(|c| {
            (0..run.samples())
                .map(|k| match record.weight[c][k] {
                    0.0 => f64::NAN,
                    _ => record.seen.values[c][k] - run.value(k, c),
                })
                .collect()
        })
        .collect()
}
