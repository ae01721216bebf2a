//! Spectra of accelerations and torques, their noise, and the error that a low-pass filter leaves in them.

use std::f64::consts::PI;
use std::ops::Range;

use super::Log;
use super::clock::interpolate;
use super::fourier::periodogram;
use super::noise_floor::noise_floor;

/// Slope of a spectrum, as the power of the frequency, that separates motion from noise in a position.
///
/// The acceleration of noise rises, that of motion falls; the acceleration's spectrum is the position's times `f^4`.
const POSITION_SLOPE: i32 = 4;

/// Slope that separates signal from noise in a torque.
///
/// The noise is flat, and the spectrum of a torque with steps, as of Coulomb friction, falls as `f^-2`: halfway is `f^-1`.
const TORQUE_SLOPE: i32 = 1;

/// Least number of changes of up to three steps in which the step of an encoder is looked for.
///
/// The probability that 9 in 10 of 20 changes of a smooth motion are multiples of the smallest is 1e-10.
const MIN_STEPS: usize = 20;

/// Frequencies `(k + 1) * spacing` of the spectra, and what filter and differences do there.
pub struct Lines {
    /// Number of samples of the transform.
    size: usize,
    /// Distance between two lines, Hz.
    pub spacing_hz: f64,
    interval_s: f64,
    /// `tan(pi f T)^8` at each line.
    warped: Vec<f64>,
    /// Squared gain of the second difference at each line, s^-4, as the window lets white noise see it.
    difference: Vec<f64>,
}

/// Spectrum of one quantity.
pub struct Channel {
    /// Density of signal and noise at each line.
    density: Vec<f64>,
    /// Density of the noise at each line.
    noise: Vec<f64>,
    /// Index of the first line that is noise alone.
    begin: usize,
}

/// Spectra of one joint.
pub struct JointSpectra {
    /// Spectrum of the acceleration, the second difference of the position.
    pub acceleration: Channel,
    /// Spectrum of the torque, without its mean.
    pub torque: Channel,
    /// Standard deviation of the position's noise, rad or m.
    pub position_noise: f64,
    /// Standard deviation of the torque's noise.
    pub torque_noise: f64,
}

impl Lines {
    /// Lines for records of up to `samples` samples.
    pub fn new(samples: usize, interval_s: f64) -> Lines {
        let size = (samples + 1).next_power_of_two();
        // Density of a second difference of white noise: the window over n samples blurs (2 sin x)^4, which near zero is the
        // fourth power of the angle 2 x. The terms are the second and fourth moments of the Hann window's spectrum, with b = pi
        // / n.
        let b = PI / samples as f64;
        let noise_gain =
            |x: f64| (2.0 * x.sin()).powi(4) + 8.0 * (2.0 * x * b).powi(2) + 16.0 / 3.0 * b.powi(4);
        let angles: Vec<f64> = (1..=size / 2).map(|k| PI * k as f64 / size as f64).collect();
        Lines {
            size,
            spacing_hz: 1.0 / (size as f64 * interval_s),
            interval_s,
            warped: angles.iter().map(|angle| angle.tan().powi(8)).collect(),
            difference: angles.iter().map(|angle| noise_gain(*angle) / interval_s.powi(4)).collect(),
        }
    }

    /// Spectra of a joint, averaged over the segments with their lengths as weights.
    pub fn joint_spectra(&self, log: &Log, joint: usize, segments: &[Range<usize>]) -> JointSpectra {
        let count = self.warped.len();
        let (mut acceleration, mut torque) = (vec![0.0; count], vec![0.0; count]);
        let total: usize = segments.iter().map(ExactSizeIterator::len).sum();
        for rows in segments {
            let weight = rows.len() as f64 / total as f64;
            let uniform = |channel: &[Vec<f64>]| {
                let values: Vec<f64> = channel[rows.clone()].iter().map(|row| row[joint]).collect();
                interpolate(&log.time_s[rows.clone()], &values, self.interval_s)
            };
            let add = |sum: &mut [f64], samples: &[f64]| {
                let density = periodogram(samples, self.interval_s, self.size);
                sum.iter_mut().zip(&density[1..]).for_each(|(sum, value)| *sum += weight * value);
            };
            // The difference comes before the window: it makes the spectrum so flat that the window's side lobes do not hide
            // the noise. Its mean is not removed: that would add a constant that hides the lowest lines of the noise.
            let scale = self.interval_s.powi(-2);
            let x = uniform(&log.position);
            let second: Vec<f64> = x.windows(3).map(|x| ((x[2] - x[1]) - (x[1] - x[0])) * scale).collect();
            add(&mut acceleration, &second);
            let mut samples = uniform(&log.torque);
            let mean = samples.iter().sum::<f64>() / samples.len() as f64;
            samples.iter_mut().for_each(|sample| *sample -= mean);
            add(&mut torque, &samples);
        }
        // A rounding error has the power step^2 / 12.
        let rounding_sum = encoder_step(log, joint).powi(2) / 12.0 / self.spacing_hz;
        let position: Vec<f64> = acceleration.iter().zip(&self.difference).map(|(s, d)| s / d).collect();
        let floor = noise_floor(&position, POSITION_SLOPE, rounding_sum);
        let torque_floor = noise_floor(&torque, TORQUE_SLOPE, 0.0);
        let deviation = |density: &[f64]| (density.iter().sum::<f64>() * self.spacing_hz).sqrt();
        let noise = floor.density.iter().zip(&self.difference).map(|(n, d)| n * d).collect();
        JointSpectra {
            position_noise: deviation(&floor.density),
            torque_noise: deviation(&torque_floor.density),
            acceleration: Channel { density: acceleration, noise, begin: floor.begin },
            torque: Channel { density: torque, noise: torque_floor.density, begin: torque_floor.begin },
        }
    }

    /// Squared error of the filtered quantity: the signal that is lost and the noise that passes.
    ///
    /// It is an unbiased estimate: the density of signal and noise less that of the noise may be negative by chance, and is not
    /// clipped.
    pub fn squared_error(&self, channel: &Channel, cutoff_hz: f64) -> f64 {
        self.error_with_signal_below(channel, cutoff_hz, self.warped.len())
    }

    fn error_with_signal_below(&self, channel: &Channel, cutoff_hz: f64, end: usize) -> f64 {
        let edge = (PI * cutoff_hz * self.interval_s).tan().powi(8);
        let mut sum = 0.0;
        for (k, warped) in self.warped.iter().enumerate() {
            let gain = edge / (edge + warped);
            let signal = if k < end { channel.density[k] - channel.noise[k] } else { 0.0 };
            sum += (1.0 - gain).powi(2) * signal + gain * gain * channel.noise[k];
        }
        sum * self.spacing_hz
    }

    /// Mean square of the quantity below the cutoff, without the noise.
    pub fn signal(&self, channel: &Channel, cutoff_hz: f64) -> f64 {
        let end = ((cutoff_hz / self.spacing_hz) as usize).min(self.warped.len());
        let pairs = channel.density[..end].iter().zip(&channel.noise[..end]);
        pairs.map(|(density, noise)| density - noise).sum::<f64>() * self.spacing_hz
    }

    /// Root mean square error of the filtered quantity, relative to the quantity.
    ///
    /// It is infinite if the quantity is hidden by noise.
    ///
    /// The lost signal is summed over the lines below the noise, because the sum over the others is chance alone.
    pub fn relative_error(&self, channel: &Channel, cutoff_hz: f64) -> f64 {
        let signal = self.signal(channel, cutoff_hz);
        let error = self.error_with_signal_below(channel, cutoff_hz, channel.begin).max(0.0);
        if signal > 0.0 { (error / signal).sqrt() } else { f64::INFINITY }
    }
}

/// Step of a joint's encoder or of its rounding, rad or m.
///
/// It is 0 if the changes between samples are not multiples of a step.
///
/// The step is the smallest change. Changes of up to three steps are within a tenth of a step of a multiple: positions that
/// were rounded once more when they were printed are, while only one in five of the changes of a smooth motion is.
fn encoder_step(log: &Log, joint: usize) -> f64 {
    let largest = log.position.iter().map(|row| row[joint].abs()).fold(0.0, f64::max);
    let changes = log.position.windows(2).map(|pair| (pair[1][joint] - pair[0][joint]).abs());
    // A change of less than this is the rounding of numbers.
    let changes: Vec<f64> = changes.filter(|change| *change > 1e-12 * largest).collect();
    let step = changes.iter().copied().fold(f64::INFINITY, f64::min);
    let few: Vec<f64> = changes.iter().map(|change| change / step).filter(|steps| *steps < 3.5).collect();
    let whole = few.iter().filter(|steps| (*steps - steps.round()).abs() < 0.1).count();
    if few.len() >= MIN_STEPS && 10 * whole > 9 * few.len() { step } else { 0.0 }
}
