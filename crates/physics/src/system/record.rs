//! One measured record, as a system sees it.

use super::schema::{Begin, Schema};
use crate::statistics::median;
use std::ops::Range;
use std::sync::Arc;

/// An input as it was recorded, on its own clock.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stream {
    /// Times, s, strictly increasing.
    pub times: Vec<f64>,
    /// `values[column][sample]`, in the unit of the column.
    pub values: Vec<Vec<f64>>,
}

/// An event that the data show, before any model was fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenEvent {
    /// When, s.
    pub time: f64,
    /// A rough value of the event's parameter.
    pub value: f64,
}

/// A piece of a record that is simulated from a start of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Window {
    /// Samples.
    pub samples: Range<usize>,
    /// Rough state at the first of them, in the order of the schema's states.
    pub start: Vec<f64>,
}

/// One measured record.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// Name in the data.
    pub id: String,
    /// Number of its group.
    pub group: usize,
    /// Times of the samples, s, strictly increasing.
    pub times: Vec<f64>,
    /// `values[channel][sample]`, in the unit of the channel; NaN where not measured.
    pub values: Vec<Vec<f64>>,
    /// Inputs, in the order of the schema; parts of one recording share them.
    pub inputs: Arc<[Stream]>,
    /// Covariates, in the order of the schema; NaN where not recorded.
    pub covariates: Vec<f64>,
    /// Windows of fits.
    pub windows: Vec<Window>,
    /// Sample ranges that are forecast one by one; none: the whole record.
    pub forecasts: Vec<Range<usize>>,
    /// Sample ranges within which the motion is smooth; none where the system does not know.
    pub pieces: Vec<Range<usize>>,
    /// Events that the data show.
    pub events: Vec<SeenEvent>,
    /// Time between two measured samples of a channel from which their noise is independent, s.
    pub memory_s: f64,
    /// How many samples, from the first, a forecast may begin from.
    pub known: usize,
    /// Whether the record begins in the middle of a motion, so that nothing is known of its start.
    pub under_way: bool,
}

impl Record {
    /// Whether the noise of sample `k` of a channel is correlated with that of `before`, the measured one before it: at most
    /// one sample was lost in between. Lost is what was not recorded, what has an empty cell, and what was masked.
    pub fn follows(&self, before: usize, k: usize) -> bool {
        self.times[k] - self.times[before] < self.memory_s
    }

    /// Median time from one sample to the next, s.
    pub fn typical_step(&self) -> f64 {
        typical_step(&self.times)
    }

    /// The covariate of index `i`, where it was recorded.
    pub fn covariate(&self, i: usize) -> Option<f64> {
        self.covariates.get(i).copied().filter(|v| v.is_finite())
    }

    /// Makes the whole record one window, of which no smooth pieces are known. Measured states start at the first value of their channel, fixed
    /// ones where the schema puts them, those with a prior at its mean, and free ones at 0.
    pub fn whole(&mut self, schema: &Schema) {
        let first = |channel: usize| {
            let values = self.values.get(channel).map_or(&[][..], Vec::as_slice);
            values.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0)
        };
        let start = schema.states.iter().map(|state| match state.begin {
            Begin::Free => 0.0,
            Begin::Fixed(value) | Begin::Prior(value, _) => value,
            Begin::Measured(channel) => first(channel),
        });
        let start = start.collect();
        let samples = 0..self.times.len();
        self.windows = vec![Window { samples, start }];
        self.pieces.clear();
        self.memory_s = MEMORY * self.typical_step();
        self.known = 1.min(self.times.len());
    }
}

/// One lost sample does not make its neighbours independent: taking them so would halve the slow part of coloured noise.
pub const MEMORY: f64 = 2.6;

/// Standard deviation of what a channel of the records measured, in its unit; 1 where that is nothing.
pub fn spread(records: &[Record], channel: usize) -> f64 {
    let each = records.iter().filter_map(|r| r.values.get(channel)).flatten().copied();
    let values: Vec<f64> = each.filter(|v| v.is_finite()).collect();
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / count;
    if variance > 0.0 { variance.sqrt() } else { 1.0 }
}

/// Median time from one of these times to the next, s.
///
/// ```
/// use augsim_physics::system::typical_step;
/// assert_eq!(typical_step(&[0.0, 0.5, 1.0, 9.0]), 0.5); // one gap changes nothing
/// ```
pub fn typical_step(times: &[f64]) -> f64 {
    median(&mut times.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>()).max(1e-6)
}

/// Longest piece, in units of the time asked for: samples are one step apart, unless some are missing.
const LONGEST: f64 = 1.2;

/// Sample ranges of `duration_s`; whole ones only, none over a gap that makes it much longer.
pub fn pieces_of(times: &[f64], duration_s: f64) -> Vec<Range<usize>> {
    let mut pieces = Vec::new();
    let mut first = 0;
    for k in 1..times.len() {
        let length = times[k] - times[first];
        if length >= duration_s {
            if length < LONGEST * duration_s {
                pieces.push(first..k + 1);
            }
            first = k;
        }
    }
    pieces
}
