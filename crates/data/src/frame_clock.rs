//! Estimates the uniform frame clock of a camera from time stamps with jitter.
//!
//! A camera takes frames at a constant period, but the time stamps are recorded with a random delay. At 10
//! m/s a delay of half a millisecond is 5 mm, which is more than the error of the camera.
//!
//! 1. A grid search over periods near the median time step, and near the median of 8 steps together, minimises the
//!    jitter, the root mean square distance of the stamps from their frames.
//! 2. Linear least squares of the stamps over their frame numbers refines the period.

use crate::dataset::Dataset;
use crate::error::DataError;
use crate::statistics::median;
use crate::trajectory::Trajectory;

/// Largest relative difference between the frame period and the median time step in the grid search.
const SEARCH_RANGE: f64 = 0.08;
/// Numbers of steps whose median length gives a first period.
///
/// Of stamps that are rounded to a resolution of up to half a period, which is the most that [`MAX_JITTER`] allows, a
/// single step can be half a period off (frames of 25 ms with stamps of 10 ms have steps of 20 and 30 ms), and the mean of
/// 8 steps 7 %, which is within [`SEARCH_RANGE`]. Where frames are lost, 8 steps are too long, and single ones right.
const LAGS: [usize; 2] = [1, 8];
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
        let grid_stamps: Vec<&[f64]> = clocks.iter().map(|t| &t[..t.len().min(MAX_GRID_STAMPS)]).collect();
        let longest = grid_stamps.iter().map(|t| t[t.len() - 1] - t[0]).fold(0.0, f64::max);
        let best = LAGS
            .iter()
            .filter_map(|lag| median_step(&clocks, *lag))
            .flat_map(|step| search_grid(step, longest))
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

/// Median over all stamps of the mean of `lag` successive time steps, s; `None` without so many steps.
fn median_step(clocks: &[&[f64]], lag: usize) -> Option<f64> {
    let mean = |w: &[f64]| (w[lag] - w[0]) / lag as f64;
    median(&mut clocks.iter().flat_map(|t| t.windows(lag + 1).map(mean)).collect::<Vec<f64>>())
}

/// Periods about `step`, s, at which the last of the stamps over `longest` s moves by [`GRID_SPACING`] frames from one to
/// the next.
fn search_grid(step: f64, longest: f64) -> impl Iterator<Item = f64> {
    let count = (SEARCH_RANGE * longest / (GRID_SPACING * step)).ceil() as i64;
    (-count..=count).map(move |i| step * (1.0 + SEARCH_RANGE * i as f64 / count as f64))
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
    fn stamps_rounded_to_hundredths_of_a_second_show_the_period_of_a_camera() {
        for (period, jitter) in [(1.0 / 30.0, 3e-3), (0.025, 4e-3), (0.022, 3.2e-3)] {
            let stamps = (0..90).map(|k| (100.0 * period * f64::from(k)).round() / 100.0);
            let clock = FrameClock::estimate(&dataset(stamps.collect())).expect("a clock");
            assert!((clock.period_s / period - 1.0).abs() < 2e-3, "{period} s: {clock:?}");
            assert!(clock.jitter_s < jitter, "{period} s: {clock:?}");
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
