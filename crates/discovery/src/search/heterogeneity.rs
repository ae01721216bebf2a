//! Test whether parameters differ between records (Kristensen and Madsen 2004, pinpointing of model
//! deficiencies).

use crate::evaluate::Lanes;
use crate::fit::{ChosenRecords, Fit, assemble_all};
use crate::linear::eliminate;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Fisher information of a record about a parameter, in the inverse square of the parameter's unit, up to which
/// the record counts as uninformative about it.
pub(crate) const MIN_INFORMATION: f64 = 1e-7;

/// Test statistic and degrees of freedom of the differences between records, for each entry of theta (the
/// shared parameters).
pub(crate) fn heterogeneity(sample: &ChosenRecords<'_>, fit: &Fit) -> Vec<(f64, f64)> {
    differences(sample, &parts(sample, fit))
}

/// For each window, its contribution to the cost in each shared parameter: (index in theta, curvature,
/// gradient). The nuisances (initial state, record parameters, event offsets) of the window are eliminated;
/// curvature and gradient are those of half the cost.
pub(crate) fn parts(sample: &ChosenRecords<'_>, fit: &Fit) -> Vec<Vec<(usize, f64, f64)>> {
    let h = &fit.hypothesis;
    let lanes: Vec<Lanes> = sample.windows().into_iter().map(|at| Lanes::new(h, at, &[])).collect();
    assemble_all(sample, h, &lanes, &fit.theta, &fit.nuisance)
        .into_par_iter()
        .zip(&lanes)
        .map(|(n, lanes)| {
            let (s, u, _) = eliminate(&n.h, &n.g, lanes.common());
            lanes.theta.iter().enumerate().map(|(a, &t)| (t, s.at(a, a), u[a])).collect()
        })
        .collect()
}

/// Test statistic and degrees of freedom of the differences between records, for each entry of theta, the
/// shared parameters. `parts` holds (index in theta, curvature, gradient) of half the cost for each window.
pub(crate) fn differences(sample: &ChosenRecords<'_>, parts: &[Vec<(usize, f64, f64)>]) -> Vec<(f64, f64)> {
    let n = parts.iter().flatten().map(|(t, ..)| t + 1).max().unwrap_or(0);
    let (mut q, mut sum_u, mut sum_s, mut count) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for windows in sample.windows_by_record() {
        // The evidence of all windows of a record together.
        let mut record: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        for &(t, s, u) in parts[windows].iter().flatten() {
            let sums = record.entry(t).or_default();
            *sums = (sums.0 + s, sums.1 + u);
        }
        for (t, (s, u)) in record.into_iter().filter(|(_, (s, _))| *s > MIN_INFORMATION) {
            q[t] += u * u / s;
            sum_u[t] += u;
            sum_s[t] += s;
            count[t] += 1.0;
        }
    }
    (0..n)
        .map(|t| {
            let mean = if sum_s[t] > 0.0 { sum_u[t] * sum_u[t] / sum_s[t] } else { 0.0 };
            (q[t] - mean, count[t] - 1.0)
        })
        .collect()
}
