//! The uniform clock of frames behind time stamps that jitter.
//!
//! A camera takes a frame every so many milliseconds; what writes the time down is late by a little, each time by another
//! little. At 10 m/s half a millisecond is 5 mm, more than the camera errs by.

use crate::dataset::Dataset;
use crate::error::DataError;
use crate::trajectory::Trajectory;

/// Farthest that the period may lie from the median step, as a share of it: whole milliseconds of a 7 ms clock err by 7 %.
const RANGE: f64 = 0.08;
/// Part of a frame by which the last stamp of the longest trajectory may move from one period that is tried to the next.
const FINE: f64 = 0.05;
/// Stamps of each trajectory by which periods are tried; all of them refine the best.
const TRIED_ON: usize = 500;
/// Most jitter, in frames, at which stamps tell their frames: three standard deviations are less than half a frame.
const MOST_JITTER: f64 = 0.16;

/// Frames of equal length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameClock {
    /// From one frame to the next, s.
    pub period_s: f64,
    /// Standard deviation of the stamps about the frames, s.
    pub jitter_s: f64,
}

impl FrameClock {
    /// The clock of all trajectories, by least squares; `None` where stamps do not tell frames.
    ///
    /// ```
    /// use augsim_data::{Dataset, FrameClock, Trajectory};
    /// // Frames of 6.93 ms, written down in whole milliseconds.
    /// let stamps: Vec<f64> = (0..60).map(|k| (6.93 * f64::from(k)).round() / 1e3).collect();
    /// let flight = Trajectory::new("1", stamps, vec![vec![0.0; 60]])?;
    /// let data = Dataset::from_names(&["height_m"], vec![flight])?;
    /// let clock = FrameClock::of(&data).expect("a clock");
    /// assert!((clock.period_s - 6.93e-3).abs() < 5e-6 && clock.jitter_s < 4e-4);
    /// # Ok::<(), augsim_data::DataError>(())
    /// ```
    pub fn of(data: &Dataset) -> Option<Self> {
        let clocks: Vec<&[f64]> = data.trajectories().iter().map(Trajectory::time_s).collect();
        let mut steps: Vec<f64> = clocks.iter().flat_map(|t| t.windows(2).map(|w| w[1] - w[0])).collect();
        steps.sort_by(f64::total_cmp);
        let median = *steps.get(steps.len() / 2)?;
        let tried_on: Vec<&[f64]> = clocks.iter().map(|t| &t[..t.len().min(TRIED_ON)]).collect();
        let longest = tried_on.iter().map(|t| t[t.len() - 1] - t[0]).fold(0.0, f64::max);
        let tried = (RANGE * longest / (FINE * median)).ceil() as i64;
        let best = (-tried..=tried)
            .map(|i| median * (1.0 + RANGE * i as f64 / tried as f64))
            .map(|period| (jitter(&tried_on, period), period))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let period_s = refined(&clocks, refined(&tried_on, best.1));
        let clock = FrameClock { period_s, jitter_s: jitter(&clocks, period_s) };
        (clock.jitter_s < MOST_JITTER * period_s).then_some(clock)
    }

    /// The data on the clock of frames: times count whole frames from the first sample of each trajectory. Of two samples in one
    /// frame the first stays.
    ///
    /// # Errors
    /// Never for data that were read: frames increase.
    pub fn steady(&self, data: &Dataset) -> Result<Dataset, DataError> {
        let steady = |t: &Trajectory| {
            let frames = frames(t.time_s(), self.period_s).0;
            let new: Vec<usize> = (0..t.len()).filter(|&k| k == 0 || frames[k] > frames[k - 1]).collect();
            let times = new.iter().map(|&k| (frames[k] - frames[0]) as f64 * self.period_s).collect();
            let values = t.values().iter().map(|v| new.iter().map(|&k| v[k]).collect()).collect();
            t.with_samples(times, values)
        };
        data.with_trajectories(data.trajectories().iter().map(steady).collect::<Result<_, _>>()?)
    }
}

/// Numbers of the frames of a clock, never decreasing, and where its frame 0 is. A stamp is rounded about the mean of those
/// before it: a later one changes no frame that was counted.
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

/// Root mean square distance of all stamps from their frames.
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

/// The period of least squares, given the frames that `period` gives.
fn refined(clocks: &[&[f64]], period: f64) -> f64 {
    let (mut above, mut below) = (0.0, 0.0);
    for times in clocks {
        let n = times.len() as f64;
        let frames = frames(times, period).0;
        let (t, k) = (times.iter().sum::<f64>() / n, frames.iter().sum::<i64>() as f64 / n);
        for (time, frame) in times.iter().zip(frames) {
            above += (time - t) * (frame as f64 - k);
            below += (frame as f64 - k).powi(2);
        }
    }
    if below > 0.0 { above / below } else { period }
}

#[cfg(test)]
mod tests {
    //! Contract: jitter goes, lost frames stay lost, and a clock that has no frames is left alone.
    use super::*;

    fn of(times: Vec<f64>) -> Dataset {
        let values = vec![times.clone()];
        let t = Trajectory::new("1", times, values).expect("a trajectory");
        Dataset::from_names(&["height_m"], vec![t]).expect("data")
    }

    #[test]
    fn stamps_in_whole_milliseconds_go_to_their_frames_and_lost_frames_stay_lost() {
        let taken: Vec<i32> = (0..120).filter(|k| ![7, 8, 40].contains(k)).collect();
        let data = of(taken.iter().map(|k| (6.927 * f64::from(*k)).round() / 1e3).collect());
        let data = data.with_path("flights.csv").with_notes(vec!["a note".to_owned()]);
        let clock = FrameClock::of(&data).expect("a clock");
        let steady = clock.steady(&data).expect("data");
        assert_eq!((steady.origin(), steady.notes()), (data.origin(), data.notes()));
        for (k, t) in taken.iter().zip(steady.trajectories()[0].time_s()) {
            assert!((t - 6.927e-3 * f64::from(*k)).abs() < 2e-4, "frame {k}: {t}");
        }
    }

    #[test]
    fn a_clock_without_frames_has_none() {
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
        assert_eq!(FrameClock::of(&of(times)), None);
        assert_eq!(FrameClock::of(&of(vec![0.0])), None);
    }
}
