//! The noise between neighbouring samples: a first idea before anything is known about the motion, and all that there is where
//! the motion has corners that nobody can name.

use crate::noise::Noise;
use crate::record::Measured;
use crate::statistics::median;

/// Standard deviation of the noise of one channel from the misfit of a parabola through neighbours, in its unit.
pub(crate) fn rough_noise(times: &[f64], y: &[f64]) -> f64 {
    1.4826 * median(&mut misfits(times, y))
}

/// Misfits of parabolas through neighbours, each in units of what noise of 1 makes it. Neighbours are samples that were measured
/// one after the other.
fn misfits(times: &[f64], y: &[f64]) -> Vec<f64> {
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
            let misfit = y[k + 2] - wa * y[k] - wb * y[k + 1] - wc * y[k + 3];
            let size = (1.0 + wa * wa + wb * wb + wc * wc).sqrt();
            misfit.is_finite().then(|| (misfit / size).abs())
        })
        .collect()
}

/// Fewest misfits from which noise is estimated.
const FEWEST: usize = 20;
/// Ratio of estimated noise to the declared accuracy of an instrument below which the accuracy is believed.
const ACCURACY: f64 = 0.7;
/// Deviation of the estimated from the declared noise, in its logarithm, that is told.
const TOLD: f64 = 0.1;

/// The noise between neighbouring samples, and weights by it. For motion with corners: what polynomials over longer stretches
/// leave there is motion, and the median misfit of the shortest does not see the corners. Channels of one unit share their
/// noise. The declared accuracy of an instrument is a lower bound: a still marker scatters less than a moving one is wrong.
pub(crate) fn between_neighbours(data: &mut Measured) -> Noise {
    let system = data.system.clone();
    let channels = &system.schema().channels;
    let estimated: Vec<Option<f64>> = (0..channels.len())
        .map(|c| {
            let each = data.records.iter().flat_map(|r| misfits(&r.seen.times, &r.seen.values[c]));
            let mut each: Vec<f64> = each.collect();
            (each.len() >= FEWEST).then(|| (1.4826 * median(&mut each)).max(1e-7))
        })
        .collect();
    let of_unit = |c: usize| -> Option<f64> {
        let alike = (0..channels.len()).filter(|&o| channels[o].unit == channels[c].unit);
        let squares: Vec<f64> = alike.map(|o| estimated[o].map(|sd| sd * sd)).collect::<Option<_>>()?;
        Some((squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    };
    let mut findings = Vec::new();
    let (mut sd, mut white) = (Vec::new(), Vec::new());
    for (c, channel) in channels.iter().enumerate() {
        let (estimated, declared) = (of_unit(c), channel.sd_at_least);
        if let (Some(e), Some(d)) = (estimated, declared)
            && (e / d).ln().abs() > TOLD
            && findings.is_empty()
        {
            findings.push("noise-scale");
        }
        // Close to what is declared the estimate is the better one; far below it something else than scatter was meant.
        let believed = estimated.filter(|e| declared.is_none_or(|d| *e > ACCURACY * d)).or(declared);
        sd.push(believed.or(estimated).unwrap_or(1e-3));
        white.push(estimated.or(declared).unwrap_or(1e-3));
    }
    for record in &mut data.records {
        let weight = |(values, sd): (&Vec<f64>, &f64)| {
            values.iter().map(|v| if v.is_finite() { 1.0 / sd } else { 0.0 }).collect()
        };
        record.weight = record.seen.values.iter().zip(&sd).map(weight).collect();
        record.tolerated = white.iter().zip(&sd).any(|(white, sd)| white < sd);
    }
    let samples: usize = data.records.iter().map(|r| r.seen.times.len()).sum();
    let freedom = samples as f64;
    Noise { sd, white, correlation: 0.0, jitter_s: 0.0, frame_s: None, findings, outliers: 0, freedom }
}
