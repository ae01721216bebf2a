//! Zero-phase Butterworth low-pass of order 4 + 4, and central differences of fourth order.
//!
//! With `w = tan(pi f T) / tan(pi f_c T)`, for the sample interval T and the cutoff `f_c`, the gain of the filter is
//!
//! ```text
//! G(f) = 1 / (1 + w^8)        (1)
//! ```
//!
//! It is the squared gain `1 / (1 + w^(2 * 4))` of one Butterworth filter of order 4, which runs forwards and then backwards,
//! so that the phase is zero.

use std::f64::consts::PI;

/// Share of an end's transient that may remain after its samples are dropped.
///
/// The reflection at the ends keeps position and speed, but not the acceleration. An error of a thousandth of the acceleration
/// is below the error that noise leaves in it in the best of logs.
const REMAINING_TRANSIENT: f64 = 1e-3;

/// Largest attenuation of the second difference at the cutoff frequency.
const DIFFERENCE_LOSS: f64 = 0.01;

/// Share of the acceleration's noise that may lie above half the decimated sample rate.
const ALIASED_SHARE: f64 = 0.01;

/// Time until a transient at an end of the record has decayed to [`REMAINING_TRANSIENT`], s.
///
/// The slowest pole of the filter decays as `exp(-2 pi f_c sin(pi/8) t)`.
pub fn transient_s(cutoff_hz: f64) -> f64 {
    -REMAINING_TRANSIENT.ln() / (2.0 * PI * cutoff_hz * (PI / 8.0).sin())
}

/// Highest cutoff frequency for a sample interval, Hz.
///
/// The second difference of order 4 has the relative error `(2 pi f T)^4 / 90`. At the cutoff it is [`DIFFERENCE_LOSS`], which
/// puts the cutoff at 0.31 of the Nyquist frequency.
pub fn highest_cutoff(interval_s: f64) -> f64 {
    (90.0 * DIFFERENCE_LOSS).powf(0.25) / (2.0 * PI * interval_s)
}

/// Number of samples of which one is kept.
///
/// White noise of the position has, in the acceleration, a power in proportion to `f^4 G(f)^2`. With `x = f / f_c` its integral
/// over all frequencies is `(1/8) Gamma(5/8) Gamma(11/8) = 0.1594`, and over those above `X` it is about `X^-11 / 11`. The
/// samples may be `n` times sparser if the share above their Nyquist frequency, `X f_c`, is at most [`ALIASED_SHARE`]: `X =
/// 1.44`. The samples that are kept are then almost uncorrelated. The gain of the filter at `X f_c` is 5 %.
pub fn decimation(cutoff_hz: f64, interval_s: f64) -> usize {
    let nyquist_over_cutoff = (11.0 * 0.1594 * ALIASED_SHARE).powf(-1.0 / 11.0);
    let ratio = 1.0 / (2.0 * nyquist_over_cutoff * cutoff_hz * interval_s);
    (ratio.floor() as usize).max(1)
}

/// One second-order section of the filter.
#[derive(Debug, Clone, Copy)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

/// A zero-phase low-pass filter.
#[derive(Debug, Clone)]
pub struct LowPass {
    sections: [Section; 2],
    /// Number of samples of the reflection at each end.
    padding: usize,
}

impl LowPass {
    /// Filter with the cutoff frequency, Hz, for samples at the interval, s; by the bilinear transform.
    pub fn new(cutoff_hz: f64, interval_s: f64) -> LowPass {
        let k = (PI * cutoff_hz * interval_s).tan();
        let sections = [PI / 8.0, 3.0 * PI / 8.0].map(|angle| {
            // The pole pair at this angle has the damping cos(angle).
            let damping = 2.0 * k * angle.cos();
            let norm = 1.0 / (1.0 + damping + k * k);
            let b0 = k * k * norm;
            Section { b: [b0, 2.0 * b0, b0], a: [2.0 * (k * k - 1.0) * norm, (1.0 - damping + k * k) * norm] }
        });
        LowPass { sections, padding: (transient_s(cutoff_hz) / interval_s).ceil() as usize }
    }

    /// Filters samples forwards and backwards; the result has no delay.
    ///
    /// The record is extended at each end by its point reflection there, and the filter starts in its steady state, as in
    /// `scipy.signal.sosfiltfilt`.
    pub fn filter(&self, samples: &[f64]) -> Vec<f64> {
        let n = samples.len();
        if n < 2 {
            return samples.to_vec();
        }
        let pad = self.padding.min(n - 1);
        let (first, last) = (samples[0], samples[n - 1]);
        let mut x: Vec<f64> = (1..=pad).rev().map(|i| 2.0 * first - samples[i]).collect();
        x.extend_from_slice(samples);
        x.extend((1..=pad).map(|i| 2.0 * last - samples[n - 1 - i]));
        for _ in 0..2 {
            for section in &self.sections {
                section.run(&mut x);
            }
            x.reverse();
        }
        x.drain(..pad);
        x.truncate(n);
        x
    }
}

impl Section {
    /// Filters in place (transposed direct form II), from the steady state of the first sample.
    fn run(&self, x: &mut [f64]) {
        let Section { b, a } = self;
        let (mut z1, mut z2) = ((1.0 - b[0]) * x[0], (b[2] - a[1]) * x[0]);
        for value in x {
            let input = *value;
            let output = b[0] * input + z1;
            z1 = b[1] * input - a[0] * output + z2;
            z2 = b[2] * input - a[1] * output;
            *value = output;
        }
    }
}

/// First derivative at sample `i` of uniform samples, by the central difference of order 4.
///
/// It needs two samples on each side.
pub fn first_difference(x: &[f64], i: usize, interval_s: f64) -> f64 {
    (8.0 * (x[i + 1] - x[i - 1]) - (x[i + 2] - x[i - 2])) / (12.0 * interval_s)
}

/// Second derivative at sample `i` of uniform samples, by the central difference of order 4.
///
/// It needs two samples on each side.
pub fn second_difference(x: &[f64], i: usize, interval_s: f64) -> f64 {
    let near = (x[i + 1] - x[i]) - (x[i] - x[i - 1]);
    let far = (x[i + 2] - x[i]) - (x[i] - x[i - 2]);
    (16.0 * near - far) / (12.0 * interval_s * interval_s)
}
