//! Choice of the cutoff frequency: the smallest error of the acceleration that the spectra promise.

use std::f64::consts::PI;

use super::clock::{interpolate, mean_interval, split_at_gaps};
use super::filter::{decimation, highest_cutoff, transient_s};
use super::fourier::periodogram;
use super::noise_floor::{NoiseFloor, noise_floor};
use super::{JointNoise, Log, Preparation, SignalError};

/// Smallest number of samples: the highest half octave of the spectrum then has the lines that its mean needs.
const MIN_SAMPLES: usize = 64;

/// Number of mean intervals without a sample that split the record for the spectra.
const SPECTRUM_GAP_INTERVALS: f64 = 10.0;

/// Number of mean intervals that are always interpolated, however high the cutoff: one or two samples may be lost.
const MIN_GAP_INTERVALS: f64 = 3.0;

/// Candidates of the cutoff in one octave; neighbours differ by 4 %, and the error is flat at its minimum.
const CANDIDATES_PER_OCTAVE: f64 = 16.0;

/// Least number of changes of up to three steps in which the step of an encoder is looked for.
///
/// The probability that 9 in 10 of 20 changes of a smooth motion are multiples of the smallest is 1e-10.
const MIN_STEPS: usize = 20;

/// Largest relative error of the acceleration of a joint that counts as moving.
///
/// A joint at rest has the error 1 or more, apart from the chance in the few lines of its lowest frequencies.
const MAX_ERROR_IN_MOTION: f64 = 0.5;

/// Spectra of one joint on the lines `(k + 1) * spacing`.
struct JointSpectra {
    /// Density of the acceleration, k = 0..lines.
    acceleration: Vec<f64>,
    /// Density of the position's noise and where the noise begins.
    floor: NoiseFloor,
    /// Standard deviation of the torque's noise.
    torque_noise: f64,
}

/// Lines of the spectra and what the filter does at them.
struct Lines {
    spacing_hz: f64,
    interval_s: f64,
    /// `tan(pi f T)^8` at each line.
    warped: Vec<f64>,
    /// Squared gain of the second difference at each line, s^-4, as the window lets white noise see it.
    difference: Vec<f64>,
}

/// Chooses how to prepare a log: clock, cutoff frequency, decimation and trimmed ends.
///
/// The spectral density of a position is `S = signal + N`, with the floor N of its noise. With the gain G of the filter and the
/// squared gain D of the second difference, the expected squared error of the acceleration is
///
/// ```text
/// E(f_c) = sum over f of (1 - G)^2 (S - N) D + G^2 N D        (2)
/// ```
///
/// the signal that is lost and the noise that passes. Its minimum keeps the band in which the signal exceeds the noise (Wiener's
/// argument). The torque equation of a joint contains the motion of all joints, so one cutoff serves all of them: the one with the
/// smallest sum of `E` relative to the mean square of each joint's acceleration, over the joints that move.
///
/// # Errors
/// Wrong shapes, times that do not increase, values that are not finite, too few samples, no motion.
pub fn choose(log: &Log) -> Result<Preparation, SignalError> {
    log.check()?;
    let samples = log.time_s.len();
    if samples < MIN_SAMPLES {
        return Err(SignalError::TooShort { samples, needed: MIN_SAMPLES });
    }
    let interval_s = mean_interval(&log.time_s);
    let segments = spectrum_segments(log, interval_s)?;
    let longest =
        segments.iter().map(|rows| log.time_s[rows.end - 1] - log.time_s[rows.start]).fold(0.0, f64::max);
    let size = ((longest / interval_s) as usize + 2).next_power_of_two();
    let lines = Lines::new(size, (longest / interval_s) as usize, interval_s);
    let spectra: Vec<JointSpectra> =
        (0..log.joints.len()).map(|joint| joint_spectra(log, joint, &segments, &lines, size)).collect();
    // The main lobe of a Hann window over the record has a width of four periods of the record.
    let candidates = cutoff_candidates(4.0 / longest, highest_cutoff(interval_s));
    let errors: Vec<(Vec<f64>, f64)> =
        spectra.iter().map(|joint| relative_errors(joint, &lines, &candidates)).collect();
    let moving: Vec<usize> =
        (0..spectra.len()).filter(|joint| errors[*joint].1 < MAX_ERROR_IN_MOTION).collect();
    let total = |k: usize| moving.iter().map(|joint| errors[*joint].0[k]).sum::<f64>();
    let best = (0..candidates.len()).min_by(|a, b| total(*a).total_cmp(&total(*b)));
    let Some(best) = best.filter(|_| !moving.is_empty()) else { return Err(SignalError::NoMotion) };
    let cutoff_hz = candidates[best];
    let noise = spectra
        .iter()
        .map(|joint| JointNoise {
            position: (joint.floor.density.iter().sum::<f64>() * lines.spacing_hz).sqrt(),
            torque: joint.torque_noise,
            acceleration_error: lines.predicted_error(joint, cutoff_hz),
        })
        .collect();
    let decimation = decimation(cutoff_hz, interval_s);
    Ok(Preparation {
        interval_s,
        cutoff_hz,
        decimation,
        rate_hz: 1.0 / (decimation as f64 * interval_s),
        trim_s: transient_s(cutoff_hz),
        // A quarter of a period of the cutoff frequency: the motion within it is almost a parabola.
        max_gap_s: (0.25 / cutoff_hz).max(MIN_GAP_INTERVALS * interval_s),
        noise,
    })
}

/// Segments for the spectra: those of at least half the length of the longest, because a spectrum of a short one is too blurred.
fn spectrum_segments(log: &Log, interval_s: f64) -> Result<Vec<std::ops::Range<usize>>, SignalError> {
    let mut segments = split_at_gaps(&log.time_s, SPECTRUM_GAP_INTERVALS * interval_s);
    let longest = segments.iter().map(std::iter::ExactSizeIterator::len).max().unwrap_or(0);
    if longest < MIN_SAMPLES {
        return Err(SignalError::TooShort { samples: longest, needed: MIN_SAMPLES });
    }
    segments.retain(|rows| 2 * rows.len() >= longest);
    Ok(segments)
}

/// Spectra of a joint, averaged over the segments with their lengths as weights.
fn joint_spectra(
    log: &Log,
    joint: usize,
    segments: &[std::ops::Range<usize>],
    lines: &Lines,
    size: usize,
) -> JointSpectra {
    let count = lines.warped.len();
    let mut acceleration = vec![0.0; count];
    let mut torque = vec![0.0; count];
    let total: usize = segments.iter().map(std::iter::ExactSizeIterator::len).sum();
    for rows in segments {
        let weight = rows.len() as f64 / total as f64;
        let uniform = |channel: &[Vec<f64>]| {
            let values: Vec<f64> = channel[rows.clone()].iter().map(|row| row[joint]).collect();
            interpolate(&log.time_s[rows.clone()], &values, lines.interval_s)
        };
        // The difference comes before the window: it makes the spectrum so flat that the window's side lobes do not hide the noise.
        let x = uniform(&log.position);
        let scale = lines.interval_s.powi(-2);
        let second: Vec<f64> = x.windows(3).map(|x| ((x[2] - x[1]) - (x[1] - x[0])) * scale).collect();
        let add = |sum: &mut [f64], samples: &[f64]| {
            let density = periodogram(samples, lines.interval_s, size);
            sum.iter_mut().zip(&density[1..]).for_each(|(sum, value)| *sum += weight * value);
        };
        add(&mut acceleration, &second);
        // Positions have no mean after the difference. To remove what is left of it would add a constant that hides the lowest lines.
        let mut samples = uniform(&log.torque);
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        samples.iter_mut().for_each(|sample| *sample -= mean);
        add(&mut torque, &samples);
    }
    let position: Vec<f64> = acceleration.iter().zip(&lines.difference).map(|(s, d)| s / d).collect();
    // Half of the power of a rounding error, a sawtooth. Lines of less power above a frequency are not told from its harmonics.
    let least_power = encoder_step(log, joint).powi(2) / 24.0 / lines.spacing_hz;
    let upper = &torque[count / 2..];
    let torque_level = upper.iter().sum::<f64>() / upper.len() as f64;
    let torque_noise = (torque_level * lines.spacing_hz * count as f64).sqrt();
    JointSpectra { acceleration, floor: noise_floor(&position, least_power), torque_noise }
}

/// Step of a joint's encoder or of its rounding, rad or m; 0 if the changes between samples are not multiples of a step.
///
/// The step is the smallest change. Changes of up to three steps are within a tenth of a step of a multiple: positions that were rounded once
/// more when they were printed are, while only one in five of the changes of a smooth motion is.
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

/// Candidates of the cutoff frequency, from the lowest to the highest; the highest alone if it is below the lowest.
fn cutoff_candidates(lowest_hz: f64, highest_hz: f64) -> Vec<f64> {
    let count = ((highest_hz / lowest_hz).log2() * CANDIDATES_PER_OCTAVE).max(0.0).floor() as usize;
    (0..=count).rev().map(|k| highest_hz * (-(k as f64) / CANDIDATES_PER_OCTAVE).exp2()).collect()
}

/// Error (2) of a joint at each cutoff, relative to the mean square of the acceleration; and the smallest predicted error.
fn relative_errors(joint: &JointSpectra, lines: &Lines, candidates: &[f64]) -> (Vec<f64>, f64) {
    let errors: Vec<f64> =
        candidates.iter().map(|cutoff| lines.error(joint, *cutoff, lines.warped.len())).collect();
    let best = (0..errors.len()).min_by(|a, b| errors[*a].total_cmp(&errors[*b])).unwrap_or(0);
    let signal = lines.signal(joint, candidates[best]);
    if signal <= 0.0 {
        return (errors, f64::INFINITY);
    }
    (errors.iter().map(|error| error / signal).collect(), lines.predicted_error(joint, candidates[best]))
}

impl Lines {
    /// Lines of a transform of `size` samples; the record has `samples` samples.
    fn new(size: usize, samples: usize, interval_s: f64) -> Lines {
        // Density of a second difference of white noise: the window over n samples blurs (2 sin x)^4, which near zero is the fourth power
        // of the angle 2 x. The terms are the second and fourth moments of the Hann window's spectrum, with b = pi / n.
        let b = PI / samples as f64;
        let noise_gain =
            |x: f64| (2.0 * x.sin()).powi(4) + 8.0 * (2.0 * x * b).powi(2) + 16.0 / 3.0 * b.powi(4);
        let spacing_hz = 1.0 / (size as f64 * interval_s);
        let angles: Vec<f64> = (1..=size / 2).map(|k| PI * k as f64 / size as f64).collect();
        Lines {
            spacing_hz,
            interval_s,
            warped: angles.iter().map(|angle| angle.tan().powi(8)).collect(),
            difference: angles.iter().map(|angle| noise_gain(*angle) / interval_s.powi(4)).collect(),
        }
    }

    /// Line at a frequency, at most the last one.
    fn line(&self, frequency_hz: f64) -> usize {
        ((frequency_hz / self.spacing_hz) as usize).min(self.warped.len())
    }

    /// Squared error (2) of the acceleration; the lost signal is that of the lines below `end`.
    ///
    /// It is an unbiased estimate: `S - N` may be negative by chance, and is not clipped.
    fn error(&self, joint: &JointSpectra, cutoff_hz: f64, end: usize) -> f64 {
        let edge = (PI * cutoff_hz * self.interval_s).tan().powi(8);
        let mut sum = 0.0;
        for (k, warped) in self.warped.iter().enumerate() {
            let gain = edge / (edge + warped);
            let noise = joint.floor.density[k] * self.difference[k];
            let signal = if k < end { joint.acceleration[k] - noise } else { 0.0 };
            sum += (1.0 - gain).powi(2) * signal + gain * gain * noise;
        }
        sum * self.spacing_hz
    }

    /// Mean square of the acceleration below the cutoff, without the noise.
    fn signal(&self, joint: &JointSpectra, cutoff_hz: f64) -> f64 {
        let lines = 0..self.line(cutoff_hz);
        let sum: f64 =
            lines.map(|k| joint.acceleration[k] - joint.floor.density[k] * self.difference[k]).sum();
        sum * self.spacing_hz
    }

    /// Root mean square error of the acceleration, relative to that of the acceleration.
    ///
    /// The lost signal is summed over the lines below the noise, because the sum over the others is chance alone.
    fn predicted_error(&self, joint: &JointSpectra, cutoff_hz: f64) -> f64 {
        let signal = self.signal(joint, cutoff_hz);
        let error = self.error(joint, cutoff_hz, joint.floor.begin).max(0.0);
        if signal > 0.0 { (error / signal).sqrt() } else { f64::INFINITY }
    }
}
