//! Structure of the residuals: against time and the system's features, autocorrelation and quantiles.

use crate::fit::{ChosenRecords, Fit};
use crate::residuals::record_residuals;
use crate::result::{Anatomy, Bin};
use crate::statistics::quantile;
use std::collections::BTreeMap;

/// Number of bins of the residuals against a feature, for display only.
const BINS: usize = 20;
/// Number of lags of the displayed autocorrelation of the residuals.
const LAGS: usize = 12;

/// Collector of the residuals of a fit, in units of the noise.
#[derive(Default)]
struct Collector {
    points: BTreeMap<String, Vec<(f64, f64)>>,
    values: Vec<f64>,
    products: [f64; LAGS],
    counts: [f64; LAGS],
}

impl Collector {
    /// Computes the bins by feature, the autocorrelation and the quantiles of the collected residuals.
    fn finish(mut self) -> (BTreeMap<String, Vec<Bin>>, Vec<f64>, Vec<f64>) {
        self.values.retain(|v| v.is_finite());
        self.values.sort_by(f64::total_cmp);
        let power = self.products[0] / self.counts[0].max(1.0);
        let lags = self.products.iter().zip(&self.counts);
        (
            self.points.into_iter().map(|(name, p)| (name, binned(p))).collect(),
            lags.map(|(p, n)| p / n.max(1.0) / power.max(1e-300)).collect(),
            [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99].iter().map(|&q| quantile(&self.values, q)).collect(),
        )
    }
}

/// Structure of the residuals of two fits to the same records: against features, in time, and in size.
pub(crate) fn anatomy(sample: &ChosenRecords<'_>, before: &Fit, after: &Fit) -> Anatomy {
    let (before, autocorrelation_before, quantiles_before) = collect(sample, before).finish();
    let (after, autocorrelation_after, quantiles_after) = collect(sample, after).finish();
    Anatomy {
        before,
        after,
        autocorrelation_before,
        autocorrelation_after,
        quantiles_before,
        quantiles_after,
    }
}

/// Collects the residuals of a fit, in units of the noise.
fn collect(sample: &ChosenRecords<'_>, fit: &Fit) -> Collector {
    let mut out = Collector::default();
    for (record, fitted) in sample.records().zip(record_residuals(sample, fit)) {
        let features = sample.data.system.residual_axes(&record.data, &fitted.events);
        for (c, r) in fitted.residuals.iter().enumerate() {
            let used = || (0..r.len()).filter(|&k| r[k].is_finite());
            let z = |k: usize| r[k] * record.weight[c][k];
            out.values.extend(used().map(z));
            for (name, values) in features.iter().filter(|_| used().next().is_some()) {
                let points = out.points.entry(name.to_string()).or_default();
                points.extend(used().map(|k| (values[k], z(k))));
            }
            for k in used() {
                for lag in (0..LAGS.min(k + 1)).filter(|lag| z(k - lag).is_finite()) {
                    out.products[lag] += z(k) * z(k - lag);
                    out.counts[lag] += 1.0;
                }
            }
        }
    }
    out
}

/// Sorts points (feature, residual) into bins of equal width; mean and root mean square residual of each bin.
fn binned(mut points: Vec<(f64, f64)>) -> Vec<Bin> {
    points.retain(|p| p.0.is_finite() && p.1.is_finite());
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (Some(first), Some(last)) = (points.first().map(|p| p.0), points.last().map(|p| p.0)) else {
        return Vec::new();
    };
    let width = ((last - first) / BINS as f64).max(1e-12);
    let mut sums = vec![(0.0, 0.0, 0usize); BINS];
    for (x, z) in points {
        let b = (((x - first) / width) as usize).min(BINS - 1);
        sums[b].0 += z;
        sums[b].1 += z * z;
        sums[b].2 += 1;
    }
    sums.into_iter()
        .enumerate()
        .filter(|(_, s)| s.2 > 0)
        .map(|(b, (s, ss, n))| Bin {
            x: first + (b as f64 + 0.5) * width,
            mean: s / n as f64,
            rms: (ss / n as f64).sqrt(),
            count: n,
        })
        .collect()
}
