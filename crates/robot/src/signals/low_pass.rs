//! Weights of a zero-phase low-pass for values that are known at given times.
//!
//! The gain is that of the filter of this folder without the bilinear transform, `G(f) = 1 / (1 + (f / f_c)^8)`. Its impulse
//! response follows from the poles `exp(i (2 k + 1) pi / 8)` of the gain by residues. With `a = 2 pi f_c |t|`,
//!
//! ```text
//! g(t) = (pi f_c / 2) sum over v in {pi/8, 3 pi/8} of exp(-a sin v) (cos v sin(a cos v) + sin v cos(a cos v))        (3)
//! ```

use std::f64::consts::PI;
use std::sync::LazyLock;

use super::filter::transient_s;

/// Entries of the table of the response in one period of the cutoff.
///
/// The error of linear interpolation between them is at most an eighth of the second derivative, `(2 pi)^2 / 8` of the peak, over
/// the square of this number: 5e-6 of the peak.
const TABLE_PER_PERIOD: f64 = 1024.0;

/// Response (3) for a cutoff of 1 Hz, at multiples of a period over [`TABLE_PER_PERIOD`] up to the reach.
static RESPONSE: LazyLock<Vec<f64>> = LazyLock::new(|| {
    let of_pole = |a: f64, v: f64| {
        let (sin, cos) = v.sin_cos();
        (-a * sin).exp() * (cos * (a * cos).sin() + sin * (a * cos).cos())
    };
    let response = |a: f64| 0.5 * PI * (of_pole(a, PI / 8.0) + of_pole(a, 3.0 * PI / 8.0));
    let count = (transient_s(1.0) * TABLE_PER_PERIOD).ceil() as u32;
    (0..=count).map(|k| response(2.0 * PI * f64::from(k) / TABLE_PER_PERIOD)).collect()
});

/// A zero-phase low-pass of values that are known at given times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowPassResponse {
    cutoff_hz: f64,
}

impl LowPassResponse {
    /// Low-pass with this cutoff, Hz.
    pub fn new(cutoff_hz: f64) -> LowPassResponse {
        LowPassResponse { cutoff_hz }
    }

    /// Largest distance of a time that counts, s: a thousandth of the response remains there.
    pub fn reach_s(self) -> f64 {
        transient_s(self.cutoff_hz)
    }

    /// Response (3) at a time after or before the impulse, 1/s; zero beyond the reach.
    pub fn at(self, time_s: f64) -> f64 {
        let place = TABLE_PER_PERIOD * self.cutoff_hz * time_s.abs();
        let (index, share) = (place as usize, place.fract());
        match RESPONSE.get(index..index + 2) {
            Some([before, after]) => self.cutoff_hz * (before + share * (after - before)),
            _ => 0.0,
        }
    }

    /// Weights of the low-pass at the offsets `-n d, ..., 0, ..., n d` for the distance `d`, s; their sum is 1.
    ///
    /// The distance must be well below half a period of the cutoff.
    pub fn weights(self, distance_s: f64) -> Vec<f64> {
        let n = (self.reach_s() / distance_s).ceil() as i32;
        let weights: Vec<f64> = (-n..=n).map(|k| self.at(f64::from(k) * distance_s)).collect();
        let sum: f64 = weights.iter().sum();
        weights.into_iter().map(|weight| weight / sum).collect()
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the weights have the gain of the recursive filter, and keep constants and straight lines.
    use super::*;
    use crate::signals::filter::LowPass;
    use approx::assert_relative_eq;

    #[test]
    fn the_weights_have_the_butterworth_gain() {
        let cutoff = 3.0;
        for distance in [1e-3, 1.0 / (16.0 * cutoff)] {
            let weights = LowPassResponse::new(cutoff).weights(distance);
            let centre = weights.len() as f64 / 2.0 - 0.5;
            let gain = |f: f64| -> f64 {
                let at = |(k, w): (usize, &f64)| w * (2.0 * PI * f * distance * (k as f64 - centre)).cos();
                weights.iter().enumerate().map(at).sum()
            };
            assert_relative_eq!(gain(0.0), 1.0, epsilon = 1e-12);
            for f in [0.5, 1.5, 3.0, 4.5, 6.0] {
                assert_relative_eq!(gain(f), 1.0 / (1.0 + (f / cutoff).powi(8)), epsilon = 1e-3);
            }
        }
    }

    #[test]
    fn the_weights_filter_a_step_as_the_recursive_filter_does() {
        let (cutoff, interval) = (5.0, 1e-3);
        let step: Vec<f64> = (0..4000).map(|i| if i < 2000 { -1.0 } else { 1.0 }).collect();
        let recursive = LowPass::new(cutoff, interval).filter(&step);
        let weights = LowPassResponse::new(cutoff).weights(interval);
        let half = weights.len() / 2;
        for i in (1000..3000).step_by(37) {
            let value: f64 = weights.iter().zip(&step[i - half..]).map(|(w, x)| w * x).sum();
            assert_relative_eq!(value, recursive[i], epsilon = 2e-3);
        }
    }
}
