//! Pushes as sequences: subsampled in time, or cut into windows.

use super::{ACTIONS, STATES};
use crate::{Sequence, Sequences, TrainerError};
use augsim_data::Dataset;
use serde::{Deserialize, Serialize};

/// Limits for subsampling pushes: every k-th sample is kept, with the smallest k that meets both.
/// Fast pushes stay shorter than slow ones; nothing is interpolated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Subsampling {
    /// Maximum number of samples of a subsampled push.
    pub samples: usize,
    /// Maximum sampling rate of a subsampled push, Hz.
    pub rate_hz: f64,
}

impl Default for Subsampling {
    /// Keeps at most 50 samples per push, at most 50 Hz.
    fn default() -> Self {
        Subsampling { samples: 50, rate_hz: 50.0 }
    }
}

impl Subsampling {
    fn stride(&self, samples: usize, duration_s: f64) -> usize {
        let by_count = (samples - 1).div_ceil(self.samples.max(2) - 1);
        let rate = (samples - 1) as f64 / duration_s;
        // A rate that is a whole multiple up to rounding counts as one.
        let by_rate = (rate / self.rate_hz - 1e-6).ceil().max(1.0) as usize;
        by_count.max(by_rate)
    }
}

/// Extracts the pushes of a data set, subsampled.
/// All values must be on one time base (`augsim_data::push::resample`).
///
/// # Errors
/// [`TrainerError`] if a column of push data or a value is missing, or a push is too short.
pub fn pushes(dataset: &Dataset, thinning: Subsampling) -> Result<Sequences, TrainerError> {
    let mut sequences = Sequences::with_actions(dataset, &STATES, &ACTIONS)?;
    for q in &mut sequences.items {
        let duration = q.action(q.time - 1)[2] - q.action(0)[2];
        let stride = thinning.stride(q.time, duration);
        *q = part(q, 0, (q.time - 1) / stride + 1, stride, q.id.clone());
        if q.time < 2 {
            return Err(TrainerError::TooShort { id: q.id.clone(), samples: q.time });
        }
    }
    Ok(sequences)
}

/// Cuts windows of `samples` samples, one every `every` samples, from each trajectory that is long enough.
/// They are named `trajectory@sample`.
pub fn windows(sequences: &Sequences, samples: usize, every: usize) -> Sequences {
    let cut = |q: &Sequence| -> Vec<Sequence> {
        let last = (q.time + 1).saturating_sub(samples);
        (0..last).step_by(every.max(1)).map(|t| part(q, t, samples, 1, format!("{}@{t}", q.id))).collect()
    };
    let items = sequences.items.iter().flat_map(cut).collect();
    Sequences { columns: sequences.columns.clone(), action_columns: sequences.action_columns.clone(), items }
}

fn part(q: &Sequence, first: usize, time: usize, stride: usize, id: String) -> Sequence {
    let rows = || (0..time).map(|i| first + i * stride);
    let states = rows().flat_map(|t| q.state(t).to_vec()).collect();
    let actions = rows().flat_map(|t| q.action(t).to_vec()).collect();
    Sequence { id, time, states, actions }
}
