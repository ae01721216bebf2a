//! Detection of a frame clock: moves samples to the regular frames about which their time stamps jitter.
//! Independent of the system.
//!
//! Either the stamps are wrong or the sampling is uneven. Between neighbouring samples the motion is a
//! parabola in the true times, so wrong times raise the apparent noise.

use crate::DiscoveryError;
use crate::difference_noise::rough_noise;
use crate::record::{Measured, Record};
use crate::statistics::median;
use augsim_data::{Dataset, FrameClock};
use augsim_system::Declaration;

/// Maximum number of trajectories from which the frame period is estimated.
const MAX_TRAJECTORIES: usize = 40;
/// Jitter of the time stamps, in frame periods, below which it is ignored.
const MIN_JITTER: f64 = 2e-3;
/// Samples per segment in which the noise with time stamps and with frame times is compared.
const STRETCH_SAMPLES: usize = 50;
/// Minimum number of segments for the comparison of the noise.
const MIN_STRETCHES: usize = 8;
/// Minimum mean log ratio (about the relative decrease) of a channel's noise for the frame times to be used.
const MIN_NOISE_DECREASE: f64 = 0.05;
/// Minimum decrease of a channel's log noise for the frame times to be used, in its standard errors.
const MIN_STANDARD_ERRORS: f64 = 5.0;
/// Limit of the absolute log noise ratio of a single segment.
const MAX_LOG_RATIO: f64 = 2.0;

/// Moves the samples to regular frame times, and returns the data with the clock. `None` where the stamps do
/// not jitter, show no frames, or are the true sampling times.
///
/// # Errors
/// [`DiscoveryError`], if the columns of the data do not fit the model.
pub(crate) fn snap_to_frames(
    model: &dyn Declaration,
    data: &Dataset,
) -> Result<Option<(Dataset, FrameClock)>, DiscoveryError> {
    let count = data.trajectories().len();
    let subset: Vec<usize> = (0..count).step_by(count.div_ceil(MAX_TRAJECTORIES).max(1)).collect();
    if is_regular(data, &subset) {
        return Ok(None);
    }
    let Some(clock) =
        FrameClock::estimate(&data.select(&subset)).filter(|c| c.jitter_s > MIN_JITTER * c.period_s)
    else {
        return Ok(None);
    };
    let Ok(steady) = clock.apply_to(data) else { return Ok(None) };
    let [at_stamps, on_frames] = [data, &steady].map(|data| Measured::from_dataset(data, model));
    Ok(is_quieter(&at_stamps?, &on_frames?).then_some((steady, clock)))
}

/// Whether the samples already lie at regular times, with gaps allowed.
fn is_regular(data: &Dataset, subset: &[usize]) -> bool {
    let times = || subset.iter().map(|&i| data.trajectories()[i].time_s());
    let mut steps: Vec<f64> = times().flat_map(|t| t.windows(2).map(|w| w[1] - w[0])).collect();
    let median = median(&mut steps);
    steps.iter().all(|step| (step / median - (step / median).round()).abs() < MIN_JITTER)
}

/// Whether frame times lower the noise of some channel significantly and raise that of none significantly.
fn is_quieter(at_stamps: &Measured, on_frames: &Measured) -> bool {
    let channels = 0..at_stamps.system.schema().channels.len();
    let log_ratios: Vec<Option<[f64; 2]>> =
        channels.map(|c| log_noise_ratio(at_stamps, on_frames, c)).collect();
    let changes_by = |sign: f64| {
        let is_significant = |[mean, error]: &[f64; 2]| {
            sign * mean > MIN_NOISE_DECREASE && sign * mean > MIN_STANDARD_ERRORS * error
        };
        log_ratios.iter().flatten().any(is_significant)
    };
    changes_by(1.0) && !changes_by(-1.0)
}

/// Mean log ratio of the noise of channel `c` at time stamps to that at frame times, and its standard error
/// over segments; `None` where there are too few.
fn log_noise_ratio(at_stamps: &Measured, on_frames: &Measured, c: usize) -> Option<[f64; 2]> {
    let mut ratios = Vec::new();
    for (stamps, frames) in at_stamps.records.iter().zip(&on_frames.records) {
        let stretches = |record: &Record| -> Vec<f64> {
            let (times, values) = (&record.data.times, &record.data.values[c]);
            let stretch = times.chunks(STRETCH_SAMPLES).zip(values.chunks(STRETCH_SAMPLES));
            stretch.filter(|(t, _)| 2 * t.len() >= STRETCH_SAMPLES).map(|(t, v)| rough_noise(t, v)).collect()
        };
        let ratio = |(stamps, frames): (f64, f64)| (stamps / frames).ln();
        let both = stretches(stamps).into_iter().zip(stretches(frames));
        ratios.extend(
            both.map(ratio).filter(|r| r.is_finite()).map(|r| r.clamp(-MAX_LOG_RATIO, MAX_LOG_RATIO)),
        );
    }
    let count = ratios.len() as f64;
    if ratios.len() < MIN_STRETCHES {
        return None;
    }
    let mean = ratios.iter().sum::<f64>() / count;
    let variance = ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (count - 1.0);
    Some([mean, (variance / count).sqrt()])
}
