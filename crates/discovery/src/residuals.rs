//! Residuals of a fit, sample by sample, and the windows that no model fits.

use crate::evaluate::{Lanes, Point};
use crate::fit::{ChosenRecords, Fit};
use crate::statistics::median;
use augsim_system::Event;

/// Residuals (measured minus predicted values) of a fit in one record.
pub(crate) struct RecordResiduals {
    /// Residuals `[channel][sample]`, in the unit of the channel. NaN where a sample is not used or lies in
    /// no window.
    pub residuals: Vec<Vec<f64>>,
    /// Events that occurred in the simulations of the record's windows, in order.
    pub events: Vec<Event>,
    /// Number of nuisances (initial states, record parameters, event offsets) that were fitted to the record.
    pub nuisances: usize,
}

/// Residuals of a fit in each record of its sample.
pub(crate) fn record_residuals(sample: &ChosenRecords<'_>, fit: &Fit) -> Vec<RecordResiduals> {
    use rayon::prelude::*;
    let ranges = sample.windows_by_record();
    ranges
        .into_par_iter()
        .enumerate()
        .map(|(i, windows)| residuals_of_record(sample, fit, i, windows))
        .collect()
}

/// Residuals in record number `i` of the sample; `windows` are the numbers of its windows in the sample.
fn residuals_of_record(
    sample: &ChosenRecords<'_>,
    fit: &Fit,
    i: usize,
    windows: std::ops::Range<usize>,
) -> RecordResiduals {
    let h = &fit.hypothesis;
    let record = &sample.data.records[sample.chosen[i]];
    let blank = vec![f64::NAN; record.data.times.len()];
    let mut out = RecordResiduals {
        residuals: vec![blank; record.data.values.len()],
        events: Vec::new(),
        nuisances: 0,
    };
    for (window, w) in record.windows().zip(windows) {
        let lanes = Lanes::new(h, window, &[]);
        let point = Point::new(h, &*h.system, &lanes, record, &fit.theta, &fit.nuisance[w]);
        let run = point.simulate_plain(&lanes, window);
        let first = window.window.samples.start;
        for (c, residuals) in out.residuals.iter_mut().enumerate() {
            for k in window.window.samples.clone().filter(|&k| record.weight[c][k] != 0.0) {
                residuals[k] = record.data.values[c][k] - run.value(k - first, c);
            }
        }
        out.events.extend(fit.events[w].iter().cloned());
        out.nuisances += fit.nuisance[w].len();
    }
    out
}

/// Ratio of a window's mean squared residual to the typical one above which it is excluded. It corresponds to
/// three standard deviations.
const EXCLUDED_RATIO: f64 = 9.0;

/// Mean squared residual, in units of the noise variance, above which a window is excluded from prediction
/// errors.
pub(crate) fn limit(best: &Fit) -> f64 {
    let mut ratios: Vec<f64> = best.residual_norms.iter().map(|[misfit, freedom]| misfit / freedom).collect();
    EXCLUDED_RATIO * median(&mut ratios).max(1.0)
}

/// Marks the windows whose mean squared residuals exceed `limit` for the calibrated and the best model. Fits
/// give them little weight already; they are counted, and excluded from the prediction errors.
pub(crate) fn outlying_windows(limit: f64, fits: [&Fit; 2]) -> Vec<bool> {
    let [base, best] = fits.map(|fit| &fit.residual_norms);
    let beyond = |[misfit, freedom]: &[f64; 2]| misfit > &(limit * freedom);
    base.iter().zip(best).map(|(a, b)| beyond(a) && beyond(b)).collect()
}
