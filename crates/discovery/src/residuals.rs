//! Residuals of a fit, sample by sample.

use crate::evaluate::{Lanes, Point};
use crate::fit::{ChosenRecords, Fit};
use augsim_physics::system::Event;

/// Residuals of a fit in one record.
pub(crate) struct Left {
    /// `[channel][sample]`, in the unit of the channel; not a number where a sample is not used or lies in no window.
    pub residuals: Vec<Vec<f64>>,
    /// The events that the simulated windows passed, in order.
    pub events: Vec<Event>,
    /// How many nuisances were fitted to the record.
    pub nuisances: usize,
}

/// Residuals of a fit in each record of its sample.
pub(crate) fn left(sample: &ChosenRecords<'_>, fit: &Fit) -> Vec<Left> {
    use rayon::prelude::*;
    let ranges = sample.of_records();
    ranges.into_par_iter().enumerate().map(|(i, windows)| one(sample, fit, i, windows)).collect()
}

fn one(sample: &ChosenRecords<'_>, fit: &Fit, i: usize, windows: std::ops::Range<usize>) -> Left {
    let h = &fit.hypothesis;
    let record = &sample.data.records[sample.chosen[i]];
    let blank = vec![f64::NAN; record.seen.times.len()];
    let mut out = Left { residuals: vec![blank; record.seen.values.len()], events: Vec::new(), nuisances: 0 };
    for (at, w) in record.excerpts().zip(windows) {
        let lanes = Lanes::new(h, at, &[]);
        let point = Point::new(h, &*h.system, &lanes, record, &fit.theta, &fit.nuisance[w]);
        let run = point.plain(&lanes, at);
        let first = at.window.samples.start;
        for (c, residuals) in out.residuals.iter_mut().enumerate() {
            for k in at.window.samples.clone().filter(|&k| record.weight[c][k] != 0.0) {
                residuals[k] = record.seen.values[c][k] - run.value(k - first, c);
            }
        }
        out.events.extend(fit.events[w].iter().cloned());
        out.nuisances += fit.nuisance[w].len();
    }
    out
}
