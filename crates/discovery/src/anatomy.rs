//! Where residuals live: against time, height, speed and bounce, their autocorrelation and their quantiles.

use crate::adequacy::residuals;
use crate::fit::{Fit, Sample};
use crate::result::{Anatomy, Bin};
use crate::statistics::quantile;
use rayon::prelude::*;
use std::collections::BTreeMap;

const BINS: usize = 20;
pub(crate) const LAGS: usize = 12;

struct Side {
    bins: BTreeMap<String, Vec<Bin>>,
    autocorrelation: Vec<f64>,
    quantiles: Vec<f64>,
}

/// Anatomy of the residuals of two fits of the same sample.
pub(crate) fn anatomy(sample: &Sample<'_>, before: &Fit, after: &Fit) -> Anatomy {
    let (b, a) = (side(sample, before), side(sample, after));
    Anatomy {
        before: b.bins,
        after: a.bins,
        autocorrelation_before: b.autocorrelation,
        autocorrelation_after: a.autocorrelation,
        quantiles_before: b.quantiles,
        quantiles_after: a.quantiles,
    }
}

fn side(sample: &Sample<'_>, fit: &Fit) -> Side {
    let vertical = sample.data.axes.count() - 1;
    let all: Vec<Vec<Vec<f64>>> =
        (0..sample.chosen.len()).into_par_iter().map(|i| residuals(sample, fit, i)).collect();
    let mut points: BTreeMap<&str, Vec<(f64, f64)>> = BTreeMap::new();
    let mut values = Vec::new();
    let (mut products, mut counts) = (vec![0.0; LAGS], vec![0.0; LAGS]);
    for (i, (record, channels)) in sample.records().zip(&all).enumerate() {
        for (c, r) in channels.iter().enumerate() {
            for k in 0..r.len() {
                let w = record.weight[c][k];
                if w == 0.0 {
                    continue;
                }
                let z = r[k] * w;
                values.push(z);
                points.entry("time_s").or_default().push((record.times[k], z));
                points.entry("height_m").or_default().push((record.y[vertical][k], z));
                if k > 0 && record.linked[k] {
                    let dt = record.times[k] - record.times[k - 1];
                    let rate = (0..record.y.len())
                        .map(|c| (record.y[c][k] - record.y[c][k - 1]).powi(2))
                        .sum::<f64>()
                        .sqrt();
                    points.entry("speed_m_s").or_default().push((rate / dt, z));
                }
                let bounce = fit.impacts[i].iter().filter(|m| m.time < record.times[k]).count();
                points.entry("bounce").or_default().push((bounce as f64, z));
                for lag in 0..LAGS.min(k + 1) {
                    let other = r[k - lag] * record.weight[c][k - lag];
                    if other.is_finite() {
                        products[lag] += z * other;
                        counts[lag] += 1.0;
                    }
                }
            }
        }
    }
    values.retain(|v| v.is_finite());
    values.sort_by(f64::total_cmp);
    let power = products[0] / f64::max(counts[0], 1.0);
    Side {
        bins: points.into_iter().map(|(name, p)| (name.to_string(), binned(p))).collect(),
        autocorrelation: products
            .iter()
            .zip(&counts)
            .map(|(p, n)| p / n.max(1.0) / power.max(1e-300))
            .collect(),
        quantiles: [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99].iter().map(|&q| quantile(&values, q)).collect(),
    }
}

pub(crate) fn binned(mut points: Vec<(f64, f64)>) -> Vec<Bin> {
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
