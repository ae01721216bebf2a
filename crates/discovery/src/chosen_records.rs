//! Records that a fit sees, and their windows.

use crate::record::{Excerpt, Measured, Record};
use std::ops::Range;

/// The records that a fit sees.
#[derive(Clone, Copy)]
pub(crate) struct ChosenRecords<'a> {
    pub data: &'a Measured,
    /// Which records.
    pub chosen: &'a [usize],
    /// Correlation of neighbouring noise.
    pub correlation: f64,
}

impl ChosenRecords<'_> {
    pub fn records(&self) -> impl Iterator<Item = &Record> {
        self.chosen.iter().map(|&j| &self.data.records[j])
    }

    /// The windows of its records, in order.
    pub fn excerpts(&self) -> Vec<Excerpt<'_>> {
        self.records().flat_map(Record::excerpts).collect()
    }

    /// Which of the windows are those of each record, in order.
    pub fn of_records(&self) -> Vec<Range<usize>> {
        let mut first = 0;
        let range = |record: &Record| {
            let last = first + record.seen.windows.len();
            std::mem::replace(&mut first, last)..last
        };
        self.records().map(range).collect()
    }
}
