//! Samples on the frames of the clock that their time stamps jitter about: an effect of the recording, the same for every system.
//!
//! Whether stamps err or the sampling itself is uneven is told by the motion: between neighbours it is a parabola at the times at
//! which the samples were taken, and more noise is left at any others.

use crate::DiscoveryError;
use crate::record::{Measured, Record};
use crate::rough_noise::rough_noise;
use crate::statistics::median;
use augsim_data::{Dataset, FrameClock};
use augsim_physics::system::Declaration;

/// Trajectories that a clock is sought in.
const SOUGHT_IN: usize = 40;
/// Jitter, in frames, below which it makes no difference.
const NO_JITTER: f64 = 2e-3;
/// Samples of each stretch in which the noise at the stamps is compared with that on the frames.
const STRETCH: usize = 50;
/// Stretches that a comparison needs.
const FEWEST: usize = 8;
/// Share by which the noise of a channel must fall on the frames.
const WORTH: f64 = 0.05;
/// Standard errors that the fall must be away from none.
const SURE: f64 = 5.0;
/// Largest logarithm of a ratio that one stretch counts with.
const MOST: f64 = 2.0;

/// The data on the frames that their stamps jitter about, and the clock; nothing where the stamps have no jitter, tell no
/// frames, or say when the samples were taken.
///
/// # Errors
/// [`DiscoveryError`] as of the data and the model.
pub(crate) fn framed(
    model: &dyn Declaration,
    data: &Dataset,
) -> Result<Option<(Dataset, FrameClock)>, DiscoveryError> {
    let count = data.trajectories().len();
    let some: Vec<usize> = (0..count).step_by(count.div_ceil(SOUGHT_IN).max(1)).collect();
    if is_even(data, &some) {
        return Ok(None);
    }
    let Some(clock) = FrameClock::of(&data.select(&some)).filter(|c| c.jitter_s > NO_JITTER * c.period_s)
    else {
        return Ok(None);
    };
    let Ok(steady) = clock.steady(data) else { return Ok(None) };
    let [at_stamps, on_frames] = [data, &steady].map(|data| Measured::from_dataset(data, model));
    Ok(is_quieter(&at_stamps?, &on_frames?).then_some((steady, clock)))
}

/// Whether the samples lie on one clock already, some of them lost.
fn is_even(data: &Dataset, some: &[usize]) -> bool {
    let times = || some.iter().map(|&i| data.trajectories()[i].time_s());
    let mut steps: Vec<f64> = times().flat_map(|t| t.windows(2).map(|w| w[1] - w[0])).collect();
    let median = median(&mut steps);
    steps.iter().all(|step| (step / median - (step / median).round()).abs() < NO_JITTER)
}

/// Whether a channel's noise falls on the frames, and none's rises.
fn is_quieter(at_stamps: &Measured, on_frames: &Measured) -> bool {
    let channels = 0..at_stamps.system.schema().channels.len();
    let falls: Vec<Option<[f64; 2]>> = channels.map(|c| fall(at_stamps, on_frames, c)).collect();
    let is_sure = |sign: f64| {
        let far = |[mean, error]: &[f64; 2]| sign * mean > WORTH && sign * mean > SURE * error;
        falls.iter().flatten().any(far)
    };
    is_sure(1.0) && !is_sure(-1.0)
}

/// Mean logarithm of the ratio of the noise of channel `c` at the stamps to that on the frames over all stretches, and its
/// standard error; none where there are too few.
fn fall(at_stamps: &Measured, on_frames: &Measured, c: usize) -> Option<[f64; 2]> {
    let mut ratios = Vec::new();
    for (stamps, frames) in at_stamps.records.iter().zip(&on_frames.records) {
        let stretches = |record: &Record| -> Vec<f64> {
            let (times, values) = (&record.seen.times, &record.seen.values[c]);
            let each = times.chunks(STRETCH).zip(values.chunks(STRETCH));
            each.filter(|(t, _)| 2 * t.len() >= STRETCH).map(|(t, v)| rough_noise(t, v)).collect()
        };
        let ratio = |(stamps, frames): (f64, f64)| (stamps / frames).ln();
        let both = stretches(stamps).into_iter().zip(stretches(frames));
        ratios.extend(both.map(ratio).filter(|r| r.is_finite()).map(|r| r.clamp(-MOST, MOST)));
    }
    let count = ratios.len() as f64;
    if ratios.len() < FEWEST {
        return None;
    }
    let mean = ratios.iter().sum::<f64>() / count;
    let variance = ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (count - 1.0);
    Some([mean, (variance / count).sqrt()])
}
