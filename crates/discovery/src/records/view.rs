//! The data as fits use them: records in windows of one length, and the blocks that are left out in turn.

use crate::options::Clock;
use crate::prepare::Prepared;
use crate::record::ChosenRecords;
use crate::record::{Measured, Record};
use crate::records::parts::{windows_as_record, with_part_weights};
use crate::score::Blocks;
use augsim_system::Window;
use std::sync::Arc;

/// Records divided into windows of one length, and the blocks that are left out in turn.
#[derive(Clone)]
pub(crate) struct View {
    data: Measured,
    chosen: Vec<usize>,
    correlation: f64,
    pub blocks: Blocks,
    /// Number of the shortest windows that each window joins: its length.
    pub joined: usize,
}

impl View {
    /// Creates a view of the records `chosen`, with `joined` of the shortest windows in each window.
    pub fn new(prepared: &Prepared, chosen: &[usize], joined: usize) -> Self {
        let sample = prepared.sample(chosen);
        let correlation = sample.correlation;
        let recordings = match prepared.data.recordings.len() {
            0 => chosen.len(),
            recordings => recordings,
        };
        let (data, chosen) = match joined {
            1 => (prepared.data.clone(), chosen.to_vec()),
            _ => joined_windows(&sample, joined),
        };
        let blocks = Blocks::new(&ChosenRecords { data: &data, chosen: &chosen, correlation }, recordings);
        Self { data, chosen, correlation, blocks, joined }
    }

    /// A copy whose simulations are counted separately and have no deadline.
    pub fn detached(&self) -> Self {
        let mut copy = self.clone();
        (copy.data.work, copy.data.clock) = (Arc::default(), Clock::default());
        copy
    }

    pub fn sample(&self) -> ChosenRecords<'_> {
        ChosenRecords { data: &self.data, chosen: &self.chosen, correlation: self.correlation }
    }

    /// Window lengths that are tried, in numbers of the shortest windows: 1, its doublings, and that of the
    /// longest recording.
    pub fn lengths(prepared: &Prepared) -> Vec<usize> {
        let recordings = prepared.data.recordings.iter();
        let most = recordings.map(|r| r.whole.data.windows.len()).max().unwrap_or(1).max(1);
        let doublings = std::iter::successors(Some(1), |joined: &usize| joined.checked_mul(2));
        let mut lengths: Vec<usize> = doublings.take_while(|joined| *joined < most).collect();
        lengths.push(most);
        lengths
    }
}

/// Divides the recordings of a sample into windows that join `joined` of the shortest ones. Also returns the
/// indices of all these records. Data of other records than those in `sample` get weight 0.
fn joined_windows(sample: &ChosenRecords<'_>, joined: usize) -> (Measured, Vec<usize>) {
    let data = sample.data;
    let rejoin = |index: usize| {
        windows_joined(&with_part_weights(data, index, |j| sample.chosen.contains(&j)), joined)
    };
    let records: Vec<Record> = (0..data.recordings.len()).flat_map(rejoin).collect();
    let everything = (0..records.len()).collect();
    (data.with_records(records), everything)
}

/// Divides a recording into parts that join `joined` windows each, as records of one window. Parts without
/// weighted samples are dropped.
fn windows_joined(whole: &Record, joined: usize) -> Vec<Record> {
    let windows = whole.data.windows.len();
    let parts = windows.div_ceil(joined.max(1));
    let part = |p: usize| {
        let mut part = windows_as_record(whole, p * windows / parts..(p + 1) * windows / parts);
        let start = part.data.windows.first().map_or_else(Vec::new, |w| w.start.clone());
        part.data.windows = vec![Window { samples: 0..part.data.times.len(), start }];
        part
    };
    let has_weight = |part: &Record| part.weight.iter().flatten().any(|w| *w > 0.0);
    (0..parts).map(part).filter(has_weight).collect()
}
