//! Where residuals of pushes live: rotation against time, heading and speed of the rod; all channels for their
//! autocorrelation and quantiles.

use super::evaluate::plain;
use super::fit::{Fit, Sample};
use crate::anatomy::{Collector, LAGS, compare};
use crate::result::Anatomy;
use augsim_physics::push::{Motion, Path};
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
        let path = r.path();
        for (k, z_k) in z.iter().enumerate() {
            let time = r.time[w.first + k];
            out.against("time_s", time - r.time[0], z_k[2]);
            // Not the recorded positions one by one: at 250 Hz their noise is faster than the rod.
            let velocity = path.as_ref().map_or([0.0; 2], |p| p.piece(time).velocity(time));
            let speed = velocity[0].hypot(velocity[1]);
            if speed > 0.0 {
                out.against("heading_rad", velocity[1].atan2(velocity[0]), z_k[2]);
                out.against("speed_m_s", speed, z_k[2]);
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
