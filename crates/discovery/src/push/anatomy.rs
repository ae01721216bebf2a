//! Where residuals of pushes live: rotation against time, heading and speed of the rod; all channels for their
//! autocorrelation and quantiles.

use super::evaluate::plain;
use super::fit::{Fit, Sample};
use crate::anatomy::{LAGS, binned};
use crate::result::{Anatomy, Bin};
use crate::statistics::quantile;
use rayon::prelude::*;
use std::collections::BTreeMap;

struct Side {
    bins: BTreeMap<String, Vec<Bin>>,
    autocorrelation: Vec<f64>,
    quantiles: Vec<f64>,
}

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
    let sd = sample.data.noise.sd;
    let residuals: Vec<Vec<[f64; 3]>> = sample
        .windows
        .par_iter()
        .zip(&fit.starts)
        .map(|(w, start)| {
            let r = &sample.data.records[w.record];
            plain(&fit.hypothesis, &fit.theta, *start, r, w)
                .iter()
                .zip(&r.pose[w.first..=w.last])
                .map(|(p, y)| [0, 1, 2].map(|c| (y[c] - p[c]) / sd[c]))
                .collect()
        })
        .collect();
    let mut points: BTreeMap<&str, Vec<(f64, f64)>> = BTreeMap::new();
    let mut values = Vec::new();
    let (mut products, mut counts) = (vec![0.0; LAGS], vec![0.0; LAGS]);
    for (w, z) in sample.windows.iter().zip(&residuals) {
        let r = &sample.data.records[w.record];
        for (k, z_k) in z.iter().enumerate() {
            let time = r.time[w.first + k];
            points.entry("time_s").or_default().push((time - r.time[0], z_k[2]));
            let next = r.rod_time.partition_point(|&t| t <= time).clamp(1, r.rod_time.len() - 1);
            let (dx, dy) = (r.rod_x[next] - r.rod_x[next - 1], r.rod_y[next] - r.rod_y[next - 1]);
            if dx != 0.0 || dy != 0.0 {
                let dt = r.rod_time[next] - r.rod_time[next - 1];
                points.entry("heading_rad").or_default().push((dy.atan2(dx), z_k[2]));
                points.entry("speed_m_s").or_default().push((dx.hypot(dy) / dt, z_k[2]));
            }
            values.extend(z_k);
            for lag in 0..LAGS.min(k + 1) {
                for c in 0..3 {
                    products[lag] += z_k[c] * z[k - lag][c];
                    counts[lag] += 1.0;
                }
            }
        }
    }
    values.retain(|v: &f64| v.is_finite());
    values.sort_by(f64::total_cmp);
    let power = products[0] / f64::max(counts[0], 1.0);
    Side {
        bins: points.into_iter().map(|(name, p)| (name.to_string(), binned(p))).collect(),
        autocorrelation: products
            .iter()
            .zip(&counts)
            .map(|(p, n)| p / f64::max(*n, 1.0) / power.max(1e-300))
            .collect(),
        quantiles: [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99].iter().map(|&q| quantile(&values, q)).collect(),
    }
}
