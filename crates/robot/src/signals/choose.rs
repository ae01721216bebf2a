//! Choice of the cutoff frequency: the smallest error of accelerations and torques that the spectra promise.

use std::ops::Range;

use super::clock::{mean_interval, split_at_gaps};
use super::filter::{decimation, highest_cutoff, transient_s};
use super::spectra::{Channel, JointSpectra, Lines};
use super::{JointNoise, Log, Preparation, SignalError};

/// Smallest number of samples: the highest half octave of the spectrum then has the lines that its mean needs.
const MIN_SAMPLES: usize = 64;

/// Number of mean intervals without a sample that split the record for the spectra.
const SPECTRUM_GAP_INTERVALS: f64 = 10.0;

/// Number of mean intervals that are interpolated, however high the cutoff.
///
/// One or two samples may be lost.
const MIN_GAP_INTERVALS: f64 = 3.0;

/// Least number of samples of the motion in a period of the cutoff of the torques, where the log has as many.
///
/// A step of friction between two samples is misplaced by up to half their distance, by its `1 / sqrt(12)` in the root mean
/// square. The response of the second filter to a step rises by about twice the cutoff per second, so the torques beside the
/// step err by `2 / (32 sqrt(12))`, 2 % of it. If the samples are those of the log, the measured torque has the same steps.
const MOTION_SAMPLES: f64 = 32.0;

/// Candidates of the cutoff in one octave; neighbours differ by 4 %, and the error is flat at its minimum.
const CANDIDATES_PER_OCTAVE: f64 = 16.0;

/// Largest relative error of an acceleration or a torque that counts in the choice.
///
/// It is the error at the cutoff that is best for this quantity alone.
///
/// That of a joint at rest is 1 or more, apart from the chance in the few lines of its lowest frequencies.
const MAX_RELATIVE_ERROR: f64 = 0.5;

/// Chooses how to prepare a log: clock, cutoff frequency, decimation and trimmed ends.
///
/// With the spectral density `S` of a quantity, the density `N` of its noise, and the gain `G` of the filter, the expected
/// squared error after the filter is
///
/// ```text
/// E(f_c) = sum over f of (1 - G)^2 (S - N) + G^2 N        (2)
/// ```
///
/// the signal that is lost and the noise that passes. Its minimum keeps the band in which the signal exceeds the noise
/// (Wiener's argument). The noise of an acceleration rises as the fourth power of the frequency.
///
/// The torque equation of a joint contains the motion of all joints, so one cutoff serves all of them. It has the smallest sum
/// of `E` relative to the mean square of the quantity, over the accelerations and torques that exceed their noise. The torques
/// count because friction puts steps into them that a smooth motion does not have.
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
    let durations = segments.iter().map(|rows| log.time_s[rows.end - 1] - log.time_s[rows.start]);
    let longest = durations.fold(0.0, f64::max);
    let lines = Lines::new((longest / interval_s) as usize + 1, interval_s);
    let spectra: Vec<JointSpectra> =
        (0..log.joints.len()).map(|joint| lines.joint_spectra(log, joint, &segments)).collect();
    // The main lobe of a Hann window over the record has a width of four periods of the record.
    let candidates = cutoff_candidates(4.0 / longest, highest_cutoff(interval_s));
    let mut total = vec![0.0; candidates.len()];
    let mut has_motion = false;
    for joint in &spectra {
        has_motion |= add_relative_errors(&mut total, &lines, &joint.acceleration, &candidates);
        add_relative_errors(&mut total, &lines, &joint.torque, &candidates);
    }
    let best = (0..candidates.len()).min_by(|a, b| total[*a].total_cmp(&total[*b]));
    let Some(best) = best.filter(|_| has_motion) else { return Err(SignalError::NoMotion) };
    let cutoff_hz = candidates[best];
    let noise = |joint: &JointSpectra| JointNoise {
        position: joint.position_noise,
        torque: joint.torque_noise,
        acceleration_error: lines.relative_error(&joint.acceleration, cutoff_hz),
        torque_error: lines.relative_error(&joint.torque, cutoff_hz),
    };
    Ok(Preparation::new(interval_s, cutoff_hz, spectra.iter().map(noise).collect()))
}

impl Preparation {
    /// Preparation with this clock, s, and this cutoff of the torques, Hz.
    ///
    /// The other cutoff, decimations, trimmed ends and longest gap follow from them.
    ///
    /// A cutoff of more than 0.155 / interval makes accelerations too small by more than 1 %.
    pub fn new(interval_s: f64, cutoff_hz: f64, noise: Vec<JointNoise>) -> Preparation {
        // An octave higher, the gain of the first filter at the cutoff of the second is 1 - 2^-8.
        let motion_cutoff_hz = (2.0 * cutoff_hz).min(highest_cutoff(interval_s)).max(cutoff_hz);
        let motion_decimation = ((1.0 / (MOTION_SAMPLES * cutoff_hz * interval_s)) as usize).max(1);
        let wanted = decimation(cutoff_hz, interval_s);
        let decimation = (wanted - wanted % motion_decimation).max(motion_decimation);
        Preparation {
            interval_s,
            cutoff_hz,
            motion_cutoff_hz,
            motion_decimation,
            decimation,
            rate_hz: 1.0 / (decimation as f64 * interval_s),
            motion_trim_s: transient_s(motion_cutoff_hz),
            trim_s: transient_s(cutoff_hz),
            // A quarter of a period of the cutoff frequency: the motion within it is almost a parabola.
            max_gap_s: (0.25 / cutoff_hz).max(MIN_GAP_INTERVALS * interval_s),
            noise,
        }
    }

    /// The same preparation with another cutoff, Hz.
    ///
    /// An example is the band in which links and gears are known to be rigid.
    pub fn with_cutoff(&self, cutoff_hz: f64) -> Preparation {
        Preparation::new(self.interval_s, cutoff_hz, self.noise.clone())
    }
}

/// Segments for the spectra: those of at least half the length of the longest.
///
/// The spectrum of a shorter one is too blurred.
fn spectrum_segments(log: &Log, interval_s: f64) -> Result<Vec<Range<usize>>, SignalError> {
    let mut segments = split_at_gaps(&log.time_s, SPECTRUM_GAP_INTERVALS * interval_s);
    let longest = segments.iter().map(ExactSizeIterator::len).max().unwrap_or(0);
    if longest < MIN_SAMPLES {
        return Err(SignalError::TooShort { samples: longest, needed: MIN_SAMPLES });
    }
    segments.retain(|rows| 2 * rows.len() >= longest);
    Ok(segments)
}

/// Candidates of the cutoff frequency, from the lowest to the highest; the highest alone if it is below the lowest.
fn cutoff_candidates(lowest_hz: f64, highest_hz: f64) -> Vec<f64> {
    let count = ((highest_hz / lowest_hz).log2() * CANDIDATES_PER_OCTAVE).max(0.0).floor() as usize;
    (0..=count).rev().map(|k| highest_hz * (-(k as f64) / CANDIDATES_PER_OCTAVE).exp2()).collect()
}

/// Adds the relative squared error of a quantity at each cutoff, if it exceeds its noise; returns whether it does.
fn add_relative_errors(total: &mut [f64], lines: &Lines, channel: &Channel, candidates: &[f64]) -> bool {
    let errors: Vec<f64> = candidates.iter().map(|cutoff| lines.squared_error(channel, *cutoff)).collect();
    let best = (0..errors.len()).min_by(|a, b| errors[*a].total_cmp(&errors[*b])).unwrap_or(0);
    let counts = lines.relative_error(channel, candidates[best]) < MAX_RELATIVE_ERROR;
    if counts {
        let signal = lines.signal(channel, candidates[best]);
        total.iter_mut().zip(errors).for_each(|(total, error)| *total += error / signal);
    }
    counts
}
