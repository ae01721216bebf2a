//! Records that a fit uses, and their windows.

use crate::record::{Measured, Record, RecordWindow};
use std::ops::Range;

/// The records that a fit uses.
#[derive(Clone, Copy)]
pub(crate) struct ChosenRecords<'a> {
    pub data: &'a Measured,
    /// Indices of the records.
    pub chosen: &'a [usize],
    /// Correlation of the noise of neighbouring samples.
    pub correlation: f64,
}

impl ChosenRecords<'_> {
    pub fn records(&self) -> impl Iterator<Item = &Record> {
        self.chosen.iter().map(|&j| &self.data.records[j])
    }

    /// Windows of the records, in order.
    pub fn windows(&self) -> Vec<RecordWindow<'_>> {
        self.records().flat_map(Record::windows).collect()
    }

    /// Range of the windows of each record, in order.
    pub fn windows_by_record(&self) -> Vec<Range<usize>> {
        let mut first = 0;
        let range = |record: &Record| {
            let last = first + record.data.windows.len();
            std::mem::replace(&mut first, last)..last
        };
        self.records().map(range).collect()
    }
}
