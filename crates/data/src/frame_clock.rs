//! Estimates the uniform frame clock of a camera from time stamps with jitter.
//!
//! A camera takes frames at a constant period, but the time stamps are recorded with a random delay. At 10
//! m/s a delay of half a millisecond is 5 mm, which is more than the error of the camera.
//!
//! 1. A grid search over periods near the median step minimises the jitter, the root mean square distance of
//!    the stamps from their frames.
//! 2. Linear least squares of the stamps over their frame numbers refines the period.

use crate::dataset::Dataset;
use crate::error::DataError;
use crate::trajectory::Trajectory;

/// Largest relative difference between the frame period and the median time step in the grid search.
///
/// Stamps in whole milliseconds of a 7 ms clock can be 7 % off.
const SEARCH_RANGE: f64 = 0.08;
/// Spacing of the search grid: shift of the last time stamp of the longest trajectory per grid step, in frames.
const GRID_SPACING: f64 = 0.05;
/// Maximum number of time stamps per trajectory in the grid search; the refinement uses all stamps.
const MAX_GRID_STAMPS: usize = 500;
/// Largest jitter of the time stamps, in frames, at which their frame numbers are identifiable.
///
/// Three standard deviations are then below half a frame.
const MAX_JITTER: f64 = 0.16;

/// Uniform clock of a camera, estimated from time stamps with jitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameClock {
    /// Period of the frames, s.
    pub period_s: f64,
    /// Root mean square difference of the time stamps from the frame times, s.
    pub jitter_s: f64,
}

impl FrameClock {
    /// Estimates the common frame clock of all trajectories; `None` if the jitter is too large for it.
    ///
    /// ```
    /// use augsim_data::{Dataset, FrameClock, Trajectory};
    /// // Frames of 6.93 ms, recorded in whole milliseconds.
    /// let stamps: Vec<f64> = (0..60).map(|k| (6.93 * f64::from(k)).round() / 1e3).collect();
    /// let flight = Trajectory::new("1", stamps, vec![vec![0.0; 60]])?;
    /// let data = Dataset::from_names(&["height_m"], vec![flight])?;
    /// let clock = FrameClock::estimate(&data).expect("a clock");
    /// assert!((clock.period_s - 6.93e-3).abs() < 5e-6 && clock.jitter_s < 4e-4);
    /// # Ok::<(), augsim_data::DataError>(())
    /// ```
    pub fn estimate(data: &Dataset) -> Option<Self> {
        let clocks: Vec<&[f64]> = data.trajectories().iter().map(Trajectory::time_s).collect();
        let mut steps: Vec<f64> = clocks.iter().flat_map(|t| t.windows(2).map(|w| w[1] - w[0])).collect();
        steps.sort_by(f64::total_cmp);
        let median = *steps.get(steps.len() / 2)?;
        let grid_stamps: Vec<&[f64]> = clocks.iter().map(|t| &t[..t.len().min(MAX_GRID_STAMPS)]).collect();
        let longest = grid_stamps.iter().map(|t| t[t.len() - 1] - t[0]).fold(0.0, f64::max);
        let grid_steps = (SEARCH_RANGE * longest / (GRID_SPACING * median)).ceil() as i64;
        let best = (-grid_steps..=grid_steps)
            .map(|i| median * (1.0 + SEARCH_RANGE * i as f64 / grid_steps as f64))
            .map(|period| (jitter(&grid_stamps, period), period))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let period_s = refined_period(&clocks, refined_period(&grid_stamps, best.1));
        let clock = FrameClock { period_s, jitter_s: jitter(&clocks, period_s) };
        (clock.jitter_s < MAX_JITTER * period_s).then_some(clock)
    }

    /// Replaces the time stamps by frame times, counted from the first sample of each trajectory.
    ///
    /// Of several samples in one frame the first is kept.
    ///
    /// # Errors
    /// Does not occur for valid data, because the kept frames increase.
    pub fn apply_to(&self, data: &Dataset) -> Result<Dataset, DataError> {
        let steady = |t: &Trajectory| {
            let frames = frames(t.time_s(), self.period_s).0;
            let kept: Vec<usize> = (0..t.len()).filter(|&k| k == 0 || frames[k] > frames[k - 1]).collect();
            let times = kept.iter().map(|&k| (frames[k] - frames[0]) as f64 * self.period_s).collect();
            let values = t.values().iter().map(|v| kept.iter().map(|&k| v[k]).collect()).collect();
            t.with_samples(times, values)
        };
        data.with_trajectories(data.trajectories().iter().map(steady).collect::<Result<_, _>>()?)
    }
}

/// Frame numbers of the time stamps, which never decrease, and the time of frame 0, s.
///
/// Each stamp is rounded relative to the mean origin of the stamps before it, so a later stamp changes no
/// earlier frame.
fn frames(times: &[f64], period: f64) -> (Vec<i64>, f64) {
    let (mut frames, mut sum): (Vec<i64>, f64) = (Vec::with_capacity(times.len()), 0.0);
    for (n, &t) in times.iter().enumerate() {
        let origin = if n == 0 { t } else { sum / n as f64 };
        let frame = ((t - origin) / period).round() as i64;
        let frame = frames.last().map_or(frame, |last| frame.max(*last));
        frames.push(frame);
        sum += t - frame as f64 * period;
    }
    (frames, sum / times.len() as f64)
}

/// Root mean square difference of all time stamps from their frame times, s.
fn jitter(clocks: &[&[f64]], period: f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for times in clocks {
        let (frames, origin) = frames(times, period);
        for (t, k) in times.iter().zip(frames) {
            sum += (t - origin - k as f64 * period).powi(2);
            count += 1.0;
        }
    }
    (sum / count).sqrt()
}

/// Frame period, s: least-squares slope of the time stamps over the frame numbers that `period` gives.
fn refined_period(clocks: &[&[f64]], period: f64) -> f64 {
    let (mut covariance, mut variance) = (0.0, 0.0);
    for times in clocks {
        let n = times.len() as f64;
        let frames = frames(times, period).0;
        let (mean_time, mean_frame) = (times.iter().sum::<f64>() / n, frames.iter().sum::<i64>() as f64 / n);
        for (time, frame) in times.iter().zip(frames) {
            covariance += (time - mean_time) * (frame as f64 - mean_frame);
            variance += (frame as f64 - mean_frame).powi(2);
        }
    }
    if variance > 0.0 { covariance / variance } else { period }
}

#[cfg(test)]
mod tests {
    //! Contract: jitter is removed, lost frames remain gaps, and stamps without a frame clock give `None`.
    use super::*;

    fn dataset(times: Vec<f64>) -> Dataset {
        let values = vec![times.clone()];
        let t = Trajectory::new("1", times, values).expect("a trajectory");
        Dataset::from_names(&["height_m"], vec![t]).expect("data")
    }

    #[test]
    fn stamps_in_whole_milliseconds_move_to_their_frames_and_lost_frames_remain_gaps() {
        let recorded: Vec<i32> = (0..120).filter(|k| ![7, 8, 40].contains(k)).collect();
        let data = dataset(recorded.iter().map(|k| (6.927 * f64::from(*k)).round() / 1e3).collect());
        let data = data.with_path("flights.csv").with_notes(vec!["a note".to_owned()]);
        let clock = FrameClock::estimate(&data).expect("a clock");
        let steady = clock.apply_to(&data).expect("data");
        assert_eq!((steady.origin(), steady.notes()), (data.origin(), data.notes()));
        for (k, t) in recorded.iter().zip(steady.trajectories()[0].time_s()) {
            assert!((t - 6.927e-3 * f64::from(*k)).abs() < 2e-4, "frame {k}: {t}");
        }
    }

    #[test]
    fn random_steps_have_no_frame_clock() {
        let mut state = 1_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut time = 0.0;
        let times = (0..200)
            .map(|_| {
                time += 0.001 + 0.01 * uniform();
                time
            })
            .collect();
        assert_eq!(FrameClock::estimate(&dataset(times)), None);
        assert_eq!(FrameClock::estimate(&dataset(vec![0.0])), None);
    }
}
