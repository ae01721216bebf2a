//! A measured record: samples, inputs, covariates, windows and detected events.

use crate::schema::{InitialValue, Schema};
use crate::statistics::median;
use std::ops::Range;
use std::sync::Arc;

/// A recorded input of a system, with its own sample times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stream {
    /// Times of the input's samples, s, strictly increasing.
    pub times: Vec<f64>,
    /// Samples of the input as `values[column][sample]`, in the unit of the column.
    pub values: Vec<Vec<f64>>,
}

/// An event, such as an impact, that is detected in the data before any model is fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetectedEvent {
    /// Time at which the event was detected, s.
    pub time: f64,
    /// Rough estimate of the event parameter at the event (for an impact: the restitution).
    pub value: f64,
}

/// A part of a record that is simulated from its own initial state.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Window {
    /// Range of the window's samples within the record.
    pub samples: Range<usize>,
    /// Rough initial state at the first sample of the window, in the order of the schema's states.
    pub start: Vec<f64>,
}

/// A measured record: samples, inputs and covariates of one recording or part of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// Identifier of the record in the data.
    pub id: String,
    /// Index of the group that the record belongs to.
    pub group: usize,
    /// Times of the record's samples, s, strictly increasing.
    pub times: Vec<f64>,
    /// Measured values as `values[channel][sample]`, in the unit of the channel; NaN where not measured.
    pub values: Vec<Vec<f64>>,
    /// Recorded inputs, in the order of the schema; records cut from one recording share them.
    pub inputs: Arc<[Stream]>,
    /// Values of the covariates (constants of the record), in the order of the schema; NaN where not recorded.
    pub covariates: Vec<f64>,
    /// Windows of the record over which models are fitted.
    pub windows: Vec<Window>,
    /// Sample ranges of the record that are forecast separately; if empty, the whole record is.
    pub forecasts: Vec<Range<usize>>,
    /// Sample ranges of the record without an event, in which the motion is smooth; empty where unknown.
    pub smooth_segments: Vec<Range<usize>>,
    /// Events detected in the data of the record.
    pub events: Vec<DetectedEvent>,
    /// Time difference from which on the noise of two samples of a channel counts as independent, s.
    pub noise_correlation_s: f64,
    /// Number of samples, from the first, that a forecast may use to estimate its initial state.
    pub initial_sample_count: usize,
    /// Whether the record begins during a motion, so that its initial state is unknown.
    pub is_mid_motion: bool,
}

impl Record {
    /// Whether the noise of sample `k` is correlated with that of the previous measured sample, `before`.
    ///
    /// True if at most one sample between them is missing. Missing samples are those not recorded, empty or masked.
    pub fn is_correlated_with(&self, before: usize, k: usize) -> bool {
        self.times[k] - self.times[before] < self.noise_correlation_s
    }

    /// Median time between samples of the record, s.
    pub fn typical_step(&self) -> f64 {
        typical_step(&self.times)
    }

    /// Value of the covariate with index `i`; `None` if it was not recorded.
    pub fn covariate(&self, i: usize) -> Option<f64> {
        self.covariates.get(i).copied().filter(|v| v.is_finite())
    }

    /// Makes the whole record one window without smooth segments, and sets its rough initial state.
    ///
    /// Measured states start at the first finite value of their channel, fixed ones at their value, those
    /// with a prior at its mean, and free ones at 0.
    pub fn use_as_one_window(&mut self, schema: &Schema) {
        let first_value = |channel: usize| {
            let values = self.values.get(channel).map_or(&[][..], Vec::as_slice);
            values.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0)
        };
        let start = schema.states.iter().map(|state| match state.initial {
            InitialValue::Free | InitialValue::PriorAboutExpression(_) => 0.0,
            InitialValue::Fixed(value) | InitialValue::Prior(value, _) => value,
            InitialValue::Measured(channel) => first_value(channel),
            InitialValue::FromRecord | InitialValue::PriorAboutRecord(_) => f64::NAN,
        });
        let start = start.collect();
        let samples = 0..self.times.len();
        self.windows = vec![Window { samples, start }];
        self.smooth_segments.clear();
        self.noise_correlation_s = CORRELATION_STEPS * self.typical_step();
        self.initial_sample_count = 1.min(self.times.len());
    }
}

/// Number of sample steps below which the noise of two samples counts as correlated.
///
/// It is above 2, so that one missing sample does not make its neighbours independent: treating them as
/// independent would halve the estimated slow part of coloured noise.
pub const CORRELATION_STEPS: f64 = 2.6;

/// Standard deviation of a channel's samples over all records, in its unit; 1 if it is 0 or there are none.
pub fn channel_sd(records: &[Record], channel: usize) -> f64 {
    let samples = records.iter().filter_map(|r| r.values.get(channel)).flatten().copied();
    let values: Vec<f64> = samples.filter(|v| v.is_finite()).collect();
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / count;
    if variance > 0.0 { variance.sqrt() } else { 1.0 }
}

/// Median difference of consecutive sample times, s; at least 1e-6.
///
/// ```
/// use augsim_system::typical_step;
/// assert_eq!(typical_step(&[0.0, 0.5, 1.0, 9.0]), 0.5); // one gap does not matter
/// ```
pub fn typical_step(times: &[f64]) -> f64 {
    median(&mut times.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>()).max(1e-6)
}

/// Maximum duration of a segment, as a multiple of the requested duration: a longer one contains a gap.
const MAX_DURATION_RATIO: f64 = 1.2;

/// Splits samples into ranges of duration `duration_s`; drops an incomplete last range, and ranges with a gap.
pub fn split_by_duration(times: &[f64], duration_s: f64) -> Vec<Range<usize>> {
    let mut ranges = Vec::new();
    let mut first = 0;
    for k in 1..times.len() {
        let length = times[k] - times[first];
        if length >= duration_s {
            if length < MAX_DURATION_RATIO * duration_s {
                ranges.push(first..k + 1);
            }
            first = k;
        }
    }
    ranges
}
