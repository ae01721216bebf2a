//! The part of the training data that a first search sees: it finds what is large at a fraction of the cost.

use crate::candidates::Family;
use crate::fit::ChosenRecords;
use crate::record::{Measured, Record};
use std::borrow::Cow;

/// Records, or windows of equations, of a first search for effects, at least.
const FEW: usize = 30;
/// Windows of all records from which on a first search for effects sees a part of them only.
const MANY_WINDOWS: usize = 200;
/// Samples of windows that a first search for formulas sees: as many as the training parts of sealed sets have, of which 35 formulas
/// of 40 are told (`discover_battery systems-inside`).
const ENOUGH_SAMPLES: usize = 4_000;

/// The data of a first search and the records of it that are chosen; `None` where the search sees all at once. Effects are
/// looked for on some of the records where laws are idealisations, and on some of the windows of long data of equations.
/// Formulas, which are many, are looked for on some of the windows.
pub(crate) fn part<'d>(
    sample: &ChosenRecords<'d>,
    family: Family,
) -> Option<(Cow<'d, Measured>, Vec<usize>)> {
    let (data, windows) = (sample.data, sample.excerpts());
    if searches_some_windows(sample, family) {
        let thinned = data.with_records(thinned(sample.records(), stride(sample)));
        let all = (0..thinned.records.len()).collect();
        return Some((Cow::Owned(thinned), all));
    }
    let stride = sample.chosen.len() / FEW;
    let has_part = data.is_idealised() && stride > 1 && windows.len() >= MANY_WINDOWS;
    has_part.then(|| (Cow::Borrowed(data), sample.chosen.iter().copied().step_by(stride).collect()))
}

/// Whether a first search sees some of the windows: of long data, for effects only where those are many, because a few long
/// ones may not show what is rare.
pub(crate) fn searches_some_windows(sample: &ChosenRecords<'_>, family: Family) -> bool {
    let are_many = || sample.excerpts().len() >= FEW * stride(sample);
    let has_part = family == Family::Grammar || sample.data.system.begins_from_first_samples() && are_many();
    is_long(sample) && has_part
}

/// Whether data have many more samples than a search needs.
pub(crate) fn is_long(sample: &ChosenRecords<'_>) -> bool {
    stride(sample) > 1
}

/// One in so many windows has enough samples of all.
fn stride(sample: &ChosenRecords<'_>) -> usize {
    let samples: usize = sample.excerpts().iter().map(|at| at.window.samples.len()).sum();
    samples / ENOUGH_SAMPLES
}

/// Records with every so manieth of all their windows; those without one are left out.
fn thinned<'r>(records: impl Iterator<Item = &'r Record>, stride: usize) -> Vec<Record> {
    let mut number = 0;
    let some = |record: &Record| {
        let mut record = record.clone();
        record.seen.windows.retain(|_| {
            number += 1;
            (number - 1) % stride == 0
        });
        record
    };
    let mut records: Vec<Record> = records.map(some).collect();
    records.retain(|record| !record.seen.windows.is_empty());
    records
}

#[cfg(test)]
mod tests {
    //! Contract: windows are counted through all records, so that those that stay lie all over the data.
    use super::*;
    use augsim_physics::system::{Record as Seen, Window};

    #[test]
    fn every_third_window_stays_wherever_records_end() {
        let record = |from: usize| {
            let windows = (from..from + 4).map(|w| Window { samples: w..w + 1, start: Vec::new() });
            let seen = Seen { windows: windows.collect(), ..Seen::default() };
            Record { seen, weight: Vec::new(), tolerated: false }
        };
        let starts = |records: &[Record], stride: usize| -> Vec<usize> {
            let left = thinned(records.iter(), stride);
            left.iter().flat_map(|r| r.seen.windows.iter().map(|w| w.samples.start)).collect()
        };
        let records = [record(0), record(4), record(8)];
        assert_eq!(starts(&records, 3), [0, 3, 6, 9]);
        assert_eq!(starts(&records, 6), [0, 6]);
        assert_eq!(thinned(records.iter(), 6).len(), 2);
    }
}
