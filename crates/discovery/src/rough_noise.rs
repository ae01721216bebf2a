//! A first idea of the noise, before anything is known about the motion.

use crate::statistics::median;

/// Standard deviation of the noise of one channel from the misfit of a parabola through neighbours, in its unit. Neighbours are samples
/// that were measured one after the other.
pub(crate) fn rough_noise(times: &[f64], y: &[f64]) -> f64 {
    let chosen: Vec<usize> = (0..y.len()).filter(|&k| y[k].is_finite()).collect();
    let at = |values: &[f64]| chosen.iter().map(|&k| values[k]).collect::<Vec<_>>();
    let (times, y) = (at(times), at(y));
    let mut misfits: Vec<f64> = (0..times.len().saturating_sub(3))
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
        .collect();
    1.4826 * median(&mut misfits)
}
