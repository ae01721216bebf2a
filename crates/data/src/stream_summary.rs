//! Summary of streams with separate clocks and of pushes, for `data inspect`.

use crate::dataset::Dataset;
use crate::push::FRESH_SUFFIX;
use crate::statistics::{digits, median};
use crate::trajectory::Trajectory;
use serde::Serialize;
use std::fmt;

/// Ratio of a sample interval of a stream to the median interval above which it counts as a gap.
///
/// It is large because clocks of robots jitter by a factor of two.
const GAP_FACTOR: f64 = 5.0;

/// Summary of a sensor stream with its own clock; a column `<name>_new` flags its measured samples.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StreamSummary {
    /// Name of the sensor stream, such as `pusher`, `object` or `force`.
    pub name: String,
    /// Number of measured (not interpolated) samples of the stream in all trajectories.
    pub samples: usize,
    /// Reciprocal of the median interval between measured samples, Hz; `None` for fewer than two samples.
    pub median_rate_hz: Option<f64>,
    /// Number of intervals between measured samples longer than 5 times the median.
    pub gaps: usize,
    /// Longest interval between measured samples, s.
    pub longest_interval_s: f64,
}

/// Ranges `[smallest, largest]`, over all pushes, of the displacements from the first to the last sample.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PushSummary {
    /// Range of the displacement of the rod, m.
    pub rod_m: [f64; 2],
    /// Range of the displacement of the object, m.
    pub object_m: [f64; 2],
    /// Range of the rotation of the object, rad.
    pub rotation_rad: [f64; 2],
}

/// Summarises the sensor streams of `dataset` in column order; empty without columns `<name>_new`.
pub(crate) fn streams(dataset: &Dataset) -> Vec<StreamSummary> {
    let stream = |(i, column): (usize, &crate::Column)| {
        let name = column.name().strip_suffix(FRESH_SUFFIX)?.to_owned();
        let mut intervals = Vec::new();
        let mut samples = 0;
        for t in dataset.trajectories() {
            let fresh_times: Vec<f64> = t
                .time_s()
                .iter()
                .zip(t.column(i))
                .filter(|(_, flag)| **flag == 1.0)
                .map(|(t, _)| *t)
                .collect();
            samples += fresh_times.len();
            intervals.extend(fresh_times.windows(2).map(|pair| pair[1] - pair[0]));
        }
        let typical = median(&mut intervals);
        let gaps = typical.map_or(0, |m| intervals.iter().filter(|&&dt| dt > GAP_FACTOR * m).count());
        let longest_interval_s = intervals.last().copied().unwrap_or(0.0);
        let median_rate_hz = typical.map(|interval| 1.0 / interval);
        Some(StreamSummary { name, samples, median_rate_hz, gaps, longest_interval_s })
    };
    dataset.columns().iter().enumerate().filter_map(stream).collect()
}

/// Ranges of displacement and rotation over all pushes; `None` where the data are not pushes.
pub(crate) fn pushes(dataset: &Dataset) -> Option<PushSummary> {
    let index = |name| dataset.column_index(name).ok();
    let rod = [index("pusher_x_m")?, index("pusher_y_m")?];
    let object = [index("x_m")?, index("y_m")?];
    let theta = index("theta_rad")?;
    let range = |quantity: &dyn Fn(&Trajectory) -> Option<f64>| {
        let values = dataset.trajectories().iter().filter_map(quantity);
        let [low, high] =
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [v.min(low), v.max(high)]);
        (low <= high).then_some([low, high])
    };
    let displacement = |t: &Trajectory, [x, y]: [usize; 2]| Some(change(t, x)?.hypot(change(t, y)?));
    Some(PushSummary {
        rod_m: range(&|t| displacement(t, rod))?,
        object_m: range(&|t| displacement(t, object))?,
        rotation_rad: range(&|t| change(t, theta))?,
    })
}

/// Last minus first measured value of a column in a trajectory; `None` without measured values.
fn change(t: &Trajectory, column: usize) -> Option<f64> {
    let mut measured = t.column(column).iter().filter(|v| v.is_finite());
    let first = *measured.next()?;
    Some(measured.next_back().unwrap_or(&first) - first)
}

impl fmt::Display for StreamSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "stream {}: {} fresh samples", self.name, self.samples)?;
        if let Some(rate) = self.median_rate_hz {
            write!(f, " at {} Hz, ", digits(rate))?;
            match self.gaps {
                0 => write!(f, "longest interval {} s", digits(self.longest_interval_s))?,
                n => write!(f, "{n} gaps up to {} s", digits(self.longest_interval_s))?,
            }
        }
        Ok(())
    }
}

impl fmt::Display for PushSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [[rod_low, rod_high], [low, high], [angle_low, angle_high]] =
            [self.rod_m, self.object_m, self.rotation_rad];
        write!(
            f,
            "pushes: rod moved {} to {} m, object {} to {} m and {} to {} rad",
            digits(rod_low),
            digits(rod_high),
            digits(low),
            digits(high),
            digits(angle_low),
            digits(angle_high)
        )
    }
}
