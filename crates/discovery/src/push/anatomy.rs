//! Where residuals of pushes live: rotation against time, heading and speed of the rod; all channels for their
//! autocorrelation and quantiles.

use super::evaluate::plain;
use super::fit::{Fit, Sample};
use crate::anatomy::{Collector, LAGS, compare};
use crate::result::Anatomy;
use rayon::prelude::*;

pub(crate) fn anatomy(sample: &Sample<'_>, before: &Fit, after: &Fit) -> Anatomy {
    compare(collect(sample, before), collect(sample, after))
}

fn collect(sample: &Sample<'_>, fit: &Fit) -> Collector {
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
    let mut out = Collector::default();
    for (w, z) in sample.windows.iter().zip(&residuals) {
        let r = &sample.data.records[w.record];
        for (k, z_k) in z.iter().enumerate() {
            let time = r.time[w.first + k];
            out.against("time_s", time - r.time[0], z_k[2]);
            let next = r.rod_time.partition_point(|&t| t <= time).clamp(1, r.rod_time.len() - 1);
            let (dx, dy) = (r.rod_x[next] - r.rod_x[next - 1], r.rod_y[next] - r.rod_y[next - 1]);
            if dx != 0.0 || dy != 0.0 {
                let dt = r.rod_time[next] - r.rod_time[next - 1];
                out.against("heading_rad", dy.atan2(dx), z_k[2]);
                out.against("speed_m_s", dx.hypot(dy) / dt, z_k[2]);
            }
            z_k.iter().for_each(|z| out.value(*z));
            for lag in 0..LAGS.min(k + 1) {
                for c in 0..3 {
                    out.pair(lag, z_k[c], z[k - lag][c]);
                }
            }
        }
    }
    out
}
