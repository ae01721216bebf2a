//! Summary of a data set in a few figures, for `data inspect`.

use crate::dataset::Dataset;
use crate::escape_control_characters::{escape_control_characters, escaped_short};
use crate::statistics::{digits, median};
use crate::stream_summary::{PushSummary, StreamSummary, pushes, streams};
use crate::trajectory::Trajectory;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// Maximum relative deviation of a regular trajectory's sampling intervals from their median.
///
/// Times that are rounded to six digits are within it, the jitter of a camera is not.
const REGULAR_TOLERANCE: f64 = 0.01;
/// Ratio of a sampling interval to the median interval above which it is a gap with a lost sample.
const GAP_FACTOR: f64 = 1.5;

/// Summary of a data set in a few figures: lengths, sampling, columns.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Origin of the data set: file name, or "data set in memory".
    pub source: String,
    /// Number of trajectories of the data set.
    pub trajectories: usize,
    /// Number of samples of all trajectories.
    pub samples: usize,
    /// Number of trajectories of each group; empty without groups.
    pub groups: BTreeMap<String, usize>,
    /// Shortest, median and longest trajectory, in samples; `None` without trajectories.
    pub length: Option<LengthSummary>,
    /// Sampling intervals and durations; `None` where no trajectory has two samples.
    pub sampling: Option<SamplingSummary>,
    /// Sensor streams with separate clocks; empty where the data set has one clock.
    pub streams: Vec<StreamSummary>,
    /// Ranges of displacement and rotation of the pushes; `None` for other data.
    pub pushes: Option<PushSummary>,
    /// Summary of each column, in file order.
    pub columns: Vec<ColumnSummary>,
}

/// Shortest, median and longest trajectory of a data set, in samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LengthSummary {
    /// Number of samples of the shortest trajectory.
    pub min: usize,
    /// Median number of samples per trajectory (the lower one of an even number of trajectories).
    pub median: usize,
    /// Number of samples of the longest trajectory.
    pub max: usize,
}

/// Sampling intervals and durations of the trajectories of a data set.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SamplingSummary {
    /// Median interval between neighbouring samples over all trajectories, s.
    pub median_interval_s: f64,
    /// Median sample rate, Hz: the reciprocal of the median interval.
    pub median_rate_hz: f64,
    /// Whether every sampling interval is within 1 % of the median of its trajectory.
    pub regular: bool,
    /// Number of sampling intervals longer than 1.5 times the median of their trajectory.
    pub gaps: usize,
    /// Longest interval between samples, s.
    pub longest_interval_s: f64,
    /// Shortest and longest duration of a trajectory, s.
    pub duration_s: [f64; 2],
}

/// Summary of one column of a data set.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ColumnSummary {
    /// Name of the column.
    pub name: String,
    /// Symbol of the column's SI unit; empty for a pure number.
    pub unit: String,
    /// Whether the column is constant in each trajectory.
    pub covariate: bool,
    /// Number of samples without a value.
    pub missing: usize,
    /// Range, mean and standard deviation of the measured values; `None` where nothing was measured.
    pub statistics: Option<Statistics>,
}

/// Range, mean and standard deviation of the measured values of a column, in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Statistics {
    /// Smallest measured value.
    pub min: f64,
    /// Mean of the measured values.
    pub mean: f64,
    /// Largest measured value.
    pub max: f64,
    /// Standard deviation of the measured values (divisor n).
    pub sd: f64,
}

impl Statistics {
    /// Computes the statistics of the values that are not NaN; `None` where there are none.
    pub fn from_values(values: impl Iterator<Item = f64> + Clone) -> Option<Statistics> {
        let measured = values.filter(|v| !v.is_nan());
        let count = measured.clone().count();
        if count == 0 {
            return None;
        }
        let mean = measured.clone().sum::<f64>() / count as f64;
        // A second pass avoids the loss of digits with a large mean.
        let variance = measured.clone().map(|v| (v - mean).powi(2)).sum::<f64>() / count as f64;
        let min = measured.clone().fold(f64::INFINITY, f64::min);
        let max = measured.fold(f64::NEG_INFINITY, f64::max);
        if min == max {
            // The rounded mean of equal values need not equal them.
            return Some(Statistics { min, mean: min, max, sd: 0.0 });
        }
        Some(Statistics { min, mean, max, sd: variance.sqrt() })
    }
}

impl Summary {
    /// Summarises `dataset`.
    pub fn from_dataset(dataset: &Dataset) -> Summary {
        let trajectories = dataset.trajectories();
        let mut groups = BTreeMap::new();
        for group in trajectories.iter().filter_map(Trajectory::group) {
            *groups.entry(group.to_owned()).or_insert(0) += 1;
        }
        let mut lengths: Vec<usize> = trajectories.iter().map(Trajectory::len).collect();
        lengths.sort_unstable();
        let length = match lengths[..] {
            [] => None,
            [min, ..] => Some(LengthSummary {
                min,
                median: lengths[(lengths.len() - 1) / 2],
                max: lengths[lengths.len() - 1],
            }),
        };
        Summary {
            source: dataset.origin().to_string(),
            trajectories: trajectories.len(),
            samples: lengths.iter().sum(),
            groups,
            length,
            sampling: sampling(trajectories),
            streams: streams(dataset),
            pushes: pushes(dataset),
            columns: columns(dataset),
        }
    }
}

fn columns(dataset: &Dataset) -> Vec<ColumnSummary> {
    let covariates: BTreeSet<&str> = dataset.covariates().map(|c| c.name()).collect();
    let summarise = |(i, column): (usize, &crate::Column)| {
        let values = dataset.trajectories().iter().flat_map(move |t| t.column(i)).copied();
        ColumnSummary {
            name: column.name().to_owned(),
            unit: column.unit().symbol(),
            covariate: covariates.contains(column.name()),
            missing: values.clone().filter(|v| v.is_nan()).count(),
            statistics: Statistics::from_values(values),
        }
    };
    dataset.columns().iter().enumerate().map(summarise).collect()
}

fn sampling(trajectories: &[Trajectory]) -> Option<SamplingSummary> {
    let mut all_intervals = Vec::new();
    let (mut regular, mut gaps) = (true, 0);
    let mut duration_s = [f64::INFINITY, f64::NEG_INFINITY];
    for t in trajectories {
        let time = t.time_s();
        let duration = time[time.len() - 1] - time[0];
        duration_s = [duration_s[0].min(duration), duration_s[1].max(duration)];
        let mut intervals: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let Some(median) = median(&mut intervals) else {
            continue;
        };
        regular &= intervals.iter().all(|dt| (dt - median).abs() <= REGULAR_TOLERANCE * median);
        gaps += intervals.iter().filter(|&&dt| dt > GAP_FACTOR * median).count();
        all_intervals.append(&mut intervals);
    }
    let median_interval_s = median(&mut all_intervals)?;
    Some(SamplingSummary {
        median_interval_s,
        median_rate_hz: 1.0 / median_interval_s,
        regular,
        gaps,
        longest_interval_s: all_intervals.last().copied()?,
        duration_s,
    })
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", escape_control_characters(&self.source))?;
        write!(f, "{} trajectories, {} samples", self.trajectories, self.samples)?;
        if let Some(length) = self.length {
            let LengthSummary { min, median, max } = length;
            if min == max {
                write!(f, ", {min} each")?;
            } else {
                write!(f, ", {min} to {max} each (median {median})")?;
            }
        }
        writeln!(f)?;
        if !self.groups.is_empty() {
            let groups: Vec<String> = self
                .groups
                .iter()
                .map(|(name, count)| format!("{} ({count})", escaped_short(name)))
                .collect();
            writeln!(f, "groups: {}", groups.join(", "))?;
        }
        if let Some(s) = self.sampling {
            let rate = digits(s.median_rate_hz);
            if self.streams.is_empty() {
                let regular = if s.regular { "regular" } else { "irregular" };
                write!(f, "sampled at {rate} Hz ({regular}), ")?;
                match s.gaps {
                    0 => write!(f, "no gaps, ")?,
                    n => write!(f, "{n} gaps up to {} s, ", digits(s.longest_interval_s))?,
                }
            } else {
                // Gaps are reported per stream; intervals between rows of the union of clocks have no
                // meaning.
                write!(f, "rows on the union of the streams' clocks ({rate} Hz), ")?;
            }
            writeln!(f, "{} to {} s long", digits(s.duration_s[0]), digits(s.duration_s[1]))?;
        }
        for stream in &self.streams {
            writeln!(f, "{stream}")?;
        }
        if let Some(pushes) = &self.pushes {
            writeln!(f, "{pushes}")?;
        }
        writeln!(f)?;
        write_table(f, &self.columns)
    }
}

fn write_table(f: &mut fmt::Formatter<'_>, columns: &[ColumnSummary]) -> fmt::Result {
    let width = columns.iter().map(|c| c.name.len()).max().unwrap_or(0).max("column".len());
    writeln!(
        f,
        "{:width$} {:>7} {:>12} {:>12} {:>12} {:>12} {:>8}",
        "column", "unit", "min", "mean", "max", "sd", "missing"
    )?;
    for c in columns {
        write!(f, "{:width$} {:>7}", c.name, if c.unit.is_empty() { "-" } else { &c.unit })?;
        match c.statistics {
            Some(s) => {
                for value in [s.min, s.mean, s.max, s.sd] {
                    write!(f, " {:>12}", digits(value))?;
                }
            }
            None => write!(f, "{:>52}", "nothing measured")?,
        }
        write!(f, " {:>8}", c.missing)?;
        writeln!(f, "{}", if c.covariate { "  constant in each trajectory" } else { "" })?;
    }
    Ok(())
}
