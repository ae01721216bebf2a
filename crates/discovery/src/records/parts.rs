//! Long records cut into parts, where there are too few records to hold some of them out.
//!
//! A model that is judged on what it was fitted to is not judged. Where a data set is one long record, or a few, their
//! windows are dealt out in blocks of neighbours (blocked cross-validation, Burman, Chow and Nolan 1994), each of which is
//! forecast from its own first samples.

use crate::record::{Measured, Record, Recording};
use augsim_physics::system::{Record as Seen, Window};
use std::ops::Range;

/// Records from which on they are dealt out whole.
const ENOUGH_RECORDS: usize = 8;
/// Blocks that few records are cut into, together.
const BLOCKS: usize = 20;
/// Samples of a recording from which on it is taken for several: a free run over more tells nothing new and takes long.
const LONGEST: usize = 10_000;
/// Part of a block that a forecast begins from, at most so many samples.
const KNOWN: (usize, usize) = (20, 50);

/// The records themselves, or their blocks where they are few and have several windows; and the recordings that are fitted in
/// several windows, with their parts among these records.
pub(crate) fn divided(records: Vec<Record>) -> (Vec<Record>, Vec<Recording>) {
    let windows: usize = records.iter().map(|r| r.seen.windows.len()).sum();
    if windows < 2 * records.len().max(1) {
        return (records, Vec::new());
    }
    if records.len() >= ENOUGH_RECORDS {
        let whole = |(j, r): (usize, &Record)| Recording { whole: r.clone(), parts: vec![(j, 0)] };
        let recordings = records.iter().enumerate().map(whole).collect();
        return (records, recordings);
    }
    let (mut out, mut recordings) = (Vec::new(), Vec::new());
    for record in &records {
        let own = record.seen.windows.len();
        let blocks = ((BLOCKS * own) as f64 / windows as f64).round().clamp(1.0, own as f64) as usize;
        let first = |block: usize| block * own / blocks;
        let sample = |block: usize| record.seen.windows[first(block)].samples.start;
        let stretches = record.seen.times.len().div_ceil(LONGEST).clamp(1, blocks);
        for stretch in 0..stretches {
            let own = stretch * blocks / stretches..(stretch + 1) * blocks / stretches;
            let parts = own.clone().map(|b| (out.len() + b, sample(b) - sample(own.start))).collect();
            recordings.push(Recording { whole: block(record, first(own.start)..first(own.end)), parts });
        }
        out.extend((0..blocks).map(|b| block(record, first(b)..first(b + 1))));
    }
    (out, recordings)
}

/// How many of so many samples of a record a forecast begins from.
pub(crate) fn known(seen: &Seen, samples: usize) -> usize {
    (samples / KNOWN.0).clamp(seen.known.min(KNOWN.1), KNOWN.1).min(samples)
}

/// The part of a record that consists of some of its windows.
pub(crate) fn block(record: &Record, windows: Range<usize>) -> Record {
    let seen = &record.seen;
    let chosen = &seen.windows[windows.clone()];
    let first = chosen.first().map_or(0, |w| w.samples.start);
    let last = chosen.last().map_or(first, |w| w.samples.end);
    let shifted = |range: &Range<usize>| range.start.max(first) - first..range.end.min(last) - first;
    let part = |values: &Vec<f64>| values[first..last].to_vec();
    let pieces = seen.pieces.iter().filter(|p| p.start < last && p.end > first).map(shifted);
    let (begin, end) = (seen.times[first], seen.times[last - 1]);
    let samples = last - first;
    Record {
        seen: Seen {
            id: format!("{} part {}", seen.id, windows.start + 1),
            group: seen.group,
            times: part(&seen.times),
            values: seen.values.iter().map(part).collect(),
            inputs: seen.inputs.clone(),
            covariates: seen.covariates.clone(),
            windows: chosen
                .iter()
                .map(|w| Window { samples: shifted(&w.samples), start: w.start.clone() })
                .collect(),
            forecasts: Vec::new(),
            pieces: pieces.collect(),
            events: seen.events.iter().filter(|e| (begin..=end).contains(&e.time)).copied().collect(),
            memory_s: seen.memory_s,
            known: known(seen, samples),
            under_way: seen.under_way || first > 0,
        },
        weight: record.weight.iter().map(part).collect(),
        tolerated: record.tolerated,
    }
}

/// A recording in the prepared windows, with the weights of those of its parts that are `wanted` and none elsewhere.
pub(crate) fn weighted(data: &Measured, index: usize, wanted: impl Fn(usize) -> bool) -> Record {
    let recording = &data.recordings[index];
    let mut record = recording.whole.clone();
    let samples = record.seen.times.len();
    record.weight = vec![vec![0.0; samples]; record.seen.values.len()];
    for &(part, first) in recording.parts.iter().filter(|(part, _)| wanted(*part)) {
        for (to, from) in record.weight.iter_mut().zip(&data.records[part].weight) {
            to[first..first + from.len()].copy_from_slice(from);
        }
    }
    record
}

/// A recording as one record of one window, with the weights of those of its parts that are `wanted` and none elsewhere.
pub(crate) fn whole(data: &Measured, index: usize, wanted: impl Fn(usize) -> bool) -> Record {
    let mut record = weighted(data, index, wanted);
    let samples = 0..record.seen.times.len();
    let start = record.seen.windows.first().map_or_else(Vec::new, |w| w.start.clone());
    record.seen.windows = vec![Window { samples, start }];
    record
}

#[cfg(test)]
mod tests {
    //! Contract: blocks hold every window once, with the samples, weights and starts that it had.
    use super::*;

    fn long(samples: usize, each: usize) -> Record {
        let cuts = (0..samples).step_by(each);
        let windows = cuts.map(|a| Window { samples: a..(a + each).min(samples), start: vec![a as f64] });
        Record {
            seen: Seen {
                times: (0..samples).map(|k| k as f64 * 0.1).collect(),
                values: vec![(0..samples).map(|k| k as f64).collect()],
                windows: windows.collect(),
                known: 5,
                ..Seen::default()
            },
            weight: vec![vec![1.0; samples]],
            tolerated: false,
        }
    }

    #[test]
    fn every_window_stands_in_one_block_with_its_samples() {
        let (blocks, recordings) = divided(vec![long(1000, 10)]);
        assert_eq!(blocks.len(), 20);
        assert_eq!(recordings.len(), 1);
        for (block, first) in &recordings[0].parts {
            assert_eq!(blocks[*block].seen.values[0][0], *first as f64);
        }
        let mut found: Vec<f64> = Vec::new();
        for b in &blocks {
            assert_eq!(b.seen.times.len(), 50);
            for w in &b.seen.windows {
                assert_eq!(b.seen.values[0][w.samples.start], w.start[0]);
                found.push(w.start[0]);
            }
        }
        found.sort_by(f64::total_cmp);
        assert_eq!(found, (0..100).map(|k| 10.0 * f64::from(k)).collect::<Vec<_>>());
        assert!(!blocks[0].seen.under_way && blocks[1].seen.under_way);
    }

    #[test]
    fn many_records_and_single_windows_stay_whole() {
        let (records, recordings) = divided(vec![long(100, 10); 8]);
        assert_eq!((records.len(), recordings.len()), (8, 8));
        let (records, recordings) = divided(vec![long(100, 100)]);
        assert_eq!((records.len(), recordings.len()), (1, 0));
    }
    #[test]
    fn few_records_share_twenty_blocks() {
        let (blocks, recordings) = divided(vec![long(100, 10); 6]);
        assert_eq!((blocks.len(), recordings.len()), (18, 6));
    }

    #[test]
    fn a_recording_of_more_than_ten_thousand_samples_is_several() {
        let recordings = |samples: usize| divided(vec![long(samples, 400)]).1.len();
        assert_eq!([8_000, 12_000].map(recordings), [1, 2]);
    }
}
