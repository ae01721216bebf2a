//! Noise estimated from differences of neighbouring samples: a first estimate before the motion is known,
//! and the only one where the motion has corners that the system does not name.

use crate::noise_estimate::Noise;
use crate::record::{Measured, Record};
use crate::statistics::median;

/// Standard deviation of one channel's noise, in its unit, from residuals of parabolas through neighbouring
/// samples.
pub(crate) fn rough_noise(times: &[f64], y: &[f64]) -> f64 {
    1.4826 * median(&mut parabola_residuals(times, y))
}

/// As [`rough_noise`], over all records; 0 where no record has four measured samples of the channel.
pub(crate) fn rough_noise_of(data: &Measured, channel: usize) -> f64 {
    let of_record = |r: &Record| parabola_residuals(&r.data.times, &r.data.values[channel]);
    let mut residuals: Vec<f64> = data.records.iter().flat_map(of_record).collect();
    if residuals.is_empty() { 0.0 } else { 1.4826 * median(&mut residuals) }
}

/// Absolute residuals of measured samples from parabolas through their neighbours.
fn parabola_residuals(times: &[f64], y: &[f64]) -> Vec<f64> {
    let chosen: Vec<usize> = (0..y.len()).filter(|&k| y[k].is_finite()).collect();
    let at = |values: &[f64]| chosen.iter().map(|&k| values[k]).collect::<Vec<_>>();
    let (times, y) = (at(times), at(y));
    (0..times.len().saturating_sub(3))
        .filter_map(|k| {
            // Lagrange weights of samples k, k+1, k+3 at the time of k+2.
            let (a, b, c, x) = (times[k], times[k + 1], times[k + 3], times[k + 2]);
            let wa = (x - b) * (x - c) / ((a - b) * (a - c));
            let wb = (x - a) * (x - c) / ((b - a) * (b - c));
            let wc = (x - a) * (x - b) / ((c - a) * (c - b));
            let residual = y[k + 2] - wa * y[k] - wb * y[k + 1] - wc * y[k + 3];
            let size = (1.0 + wa * wa + wb * wb + wc * wc).sqrt();
            residual.is_finite().then(|| (residual / size).abs())
        })
        .collect()
}

/// Minimum number of parabola residuals for a noise estimate.
const MIN_RESIDUALS: usize = 20;
/// Ratio of the estimated noise to the declared accuracy of an instrument below which the accuracy is used.
const MIN_ACCURACY_RATIO: f64 = 0.7;
/// Absolute logarithm of the ratio of estimated to declared noise above which the difference is reported.
const MIN_REPORTED_LOG_RATIO: f64 = 0.1;

/// Estimates the noise of each channel from differences of neighbouring samples, and sets the weights of all
/// samples. Suits motion with corners, where the residuals of longer polynomials would be motion. The median
/// over short differences is insensitive to the corners. Channels with the same unit share their noise. The
/// declared accuracy of an instrument is a lower bound, because the scatter of a marker at rest understates
/// the errors of a moving one.
pub(crate) fn noise_from_differences(data: &mut Measured) -> Noise {
    let system = data.system.clone();
    let channels = &system.schema().channels;
    let by_channel: Vec<Option<f64>> = (0..channels.len())
        .map(|c| {
            let residuals =
                data.records.iter().flat_map(|r| parabola_residuals(&r.data.times, &r.data.values[c]));
            let mut residuals: Vec<f64> = residuals.collect();
            (residuals.len() >= MIN_RESIDUALS).then(|| (1.4826 * median(&mut residuals)).max(1e-7))
        })
        .collect();
    let of_unit = |c: usize| -> Option<f64> {
        let same_unit = (0..channels.len()).filter(|&o| channels[o].unit == channels[c].unit);
        let squares: Vec<f64> = same_unit.map(|o| by_channel[o].map(|sd| sd * sd)).collect::<Option<_>>()?;
        Some((squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    };
    let mut findings = Vec::new();
    let (mut sd, mut white) = (Vec::new(), Vec::new());
    for (c, channel) in channels.iter().enumerate() {
        let (estimated, declared) = (of_unit(c), channel.min_sd);
        if let (Some(e), Some(d)) = (estimated, declared)
            && (e / d).ln().abs() > MIN_REPORTED_LOG_RATIO
            && findings.is_empty()
        {
            findings.push("noise-scale");
        }
        // An estimate near the declared accuracy is the better one; one far below means that the accuracy
        // is not a scatter.
        let accepted =
            estimated.filter(|e| declared.is_none_or(|d| *e > MIN_ACCURACY_RATIO * d)).or(declared);
        sd.push(accepted.or(estimated).unwrap_or(1e-3));
        white.push(estimated.or(declared).unwrap_or(1e-3));
    }
    for record in &mut data.records {
        let weight = |(values, sd): (&Vec<f64>, &f64)| {
            values.iter().map(|v| if v.is_finite() { 1.0 / sd } else { 0.0 }).collect()
        };
        record.weight = record.data.values.iter().zip(&sd).map(weight).collect();
        record.is_tolerance = white.iter().zip(&sd).any(|(white, sd)| white < sd);
    }
    Noise { sd, white, correlation: 0.0, jitter_s: 0.0, frame_s: None, findings, outliers: 0 }
}
