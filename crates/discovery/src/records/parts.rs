//! Division of long records into parts, where there are too few records to hold some out.
//!
//! The windows of one long record, or a few, are divided into blocks of neighbours (blocked
//! cross-validation, Burman, Chow and Nolan 1994), each of which is predicted from its own first samples.

use crate::record::{Measured, Record, Recording};
use crate::score::are_comparable;
use augsim_system::{Record as SystemRecord, Window};
use std::ops::Range;

/// Number of records from which on they are kept whole instead of being divided into blocks.
const MIN_WHOLE_RECORDS: usize = 8;
/// Number of records of a group from which on they are kept whole. A fold of the data then leaves three quarters of
/// every group.
pub(crate) const MIN_WHOLE_RECORDS_PER_GROUP: usize = 4;
/// Total number of blocks into which a few records are divided.
const TOTAL_BLOCKS: usize = 20;
/// Number of samples above which a recording is treated as several. Longer free runs add cost, not
/// information.
const MAX_RUN_SAMPLES: usize = 10_000;
/// Number of samples from which a prediction of a block starts: 1/20 of the block's samples, at most 50.
const KNOWN_SAMPLES: (usize, usize) = (20, 50);

/// Divides few records into blocks of windows, and keeps many records whole. Also returns the recordings that
/// are fitted in several windows, with the indices of their parts. `groups` is the number of groups to which the
/// records belong.
pub(crate) fn split_into_blocks(records: Vec<Record>, groups: usize) -> (Vec<Record>, Vec<Recording>) {
    let windows: usize = records.iter().map(|r| r.data.windows.len()).sum();
    if windows < 2 * records.len().max(1) {
        return (records, Vec::new());
    }
    let of_group = |g: usize| records.iter().filter(move |r| r.data.group == g).count();
    let is_grouped = are_comparable(groups);
    let are_enough = !is_grouped || (0..groups).all(|g| of_group(g) >= MIN_WHOLE_RECORDS_PER_GROUP);
    let total_blocks =
        if is_grouped { TOTAL_BLOCKS.max(MIN_WHOLE_RECORDS_PER_GROUP * groups) } else { TOTAL_BLOCKS };
    if records.len() >= MIN_WHOLE_RECORDS && are_enough {
        let whole = |(j, r): (usize, &Record)| Recording { whole: r.clone(), parts: vec![(j, 0)] };
        let recordings = records.iter().enumerate().map(whole).collect();
        return (records, recordings);
    }
    let (mut out, mut recordings) = (Vec::new(), Vec::new());
    for record in &records {
        let window_count = record.data.windows.len();
        let blocks = ((total_blocks * window_count) as f64 / windows as f64)
            .round()
            .clamp(1.0, window_count as f64) as usize;
        let first = |block: usize| block * window_count / blocks;
        let sample = |block: usize| record.data.windows[first(block)].samples.start;
        let stretches = record.data.times.len().div_ceil(MAX_RUN_SAMPLES).clamp(1, blocks);
        for stretch in 0..stretches {
            let part_blocks = stretch * blocks / stretches..(stretch + 1) * blocks / stretches;
            let parts =
                part_blocks.clone().map(|b| (out.len() + b, sample(b) - sample(part_blocks.start))).collect();
            recordings.push(Recording {
                whole: windows_as_record(record, first(part_blocks.start)..first(part_blocks.end)),
                parts,
            });
        }
        out.extend((0..blocks).map(|b| windows_as_record(record, first(b)..first(b + 1))));
    }
    (out, recordings)
}

/// Number of known samples from which a prediction of `samples` samples of a record starts.
pub(crate) fn known_samples(data: &SystemRecord, samples: usize) -> usize {
    (samples / KNOWN_SAMPLES.0)
        .clamp(data.initial_sample_count.min(KNOWN_SAMPLES.1), KNOWN_SAMPLES.1)
        .min(samples)
}

/// Cuts some consecutive windows out of a record, as a record of their own.
pub(crate) fn windows_as_record(record: &Record, windows: Range<usize>) -> Record {
    let data = &record.data;
    let chosen = &data.windows[windows.clone()];
    let first = chosen.first().map_or(0, |w| w.samples.start);
    let last = chosen.last().map_or(first, |w| w.samples.end);
    let shifted = |range: &Range<usize>| range.start.max(first) - first..range.end.min(last) - first;
    let part = |values: &Vec<f64>| values[first..last].to_vec();
    let pieces = data.smooth_segments.iter().filter(|p| p.start < last && p.end > first).map(shifted);
    let (begin, end) = (data.times[first], data.times[last - 1]);
    let samples = last - first;
    Record {
        data: SystemRecord {
            id: format!("{} part {}", data.id, windows.start + 1),
            times: part(&data.times),
            values: data.values.iter().map(part).collect(),
            windows: chosen
                .iter()
                .map(|w| Window { samples: shifted(&w.samples), start: w.start.clone() })
                .collect(),
            forecasts: Vec::new(),
            smooth_segments: pieces.collect(),
            events: data.events.iter().filter(|e| (begin..=end).contains(&e.time)).copied().collect(),
            initial_sample_count: known_samples(data, samples),
            is_mid_motion: data.is_mid_motion || first > 0,
            ..data.clone()
        },
        weight: record.weight.iter().map(part).collect(),
        is_tolerance: record.is_tolerance,
        recording: record.recording.clone(),
    }
}

/// A recording in the shortest windows. Samples have their weights in the parts for which `wanted` is true,
/// and weight 0 elsewhere.
pub(crate) fn with_part_weights(data: &Measured, index: usize, wanted: impl Fn(usize) -> bool) -> Record {
    let recording = &data.recordings[index];
    let mut record = recording.whole.clone();
    let samples = record.data.times.len();
    record.weight = vec![vec![0.0; samples]; record.data.values.len()];
    for &(part, first) in recording.parts.iter().filter(|(part, _)| wanted(*part)) {
        for (to, from) in record.weight.iter_mut().zip(&data.records[part].weight) {
            to[first..first + from.len()].copy_from_slice(from);
        }
    }
    record
}

/// A recording as a record of one window. Samples have their weights in the parts for which `wanted` is true,
/// and weight 0 elsewhere.
pub(crate) fn as_single_window(data: &Measured, index: usize, wanted: impl Fn(usize) -> bool) -> Record {
    let mut record = with_part_weights(data, index, wanted);
    let samples = 0..record.data.times.len();
    let start = record.data.windows.first().map_or_else(Vec::new, |w| w.start.clone());
    record.data.windows = vec![Window { samples, start }];
    record
}

#[cfg(test)]
mod tests {
    //! Contract: blocks contain every window once, with its samples, weights and initial state.
    use super::*;

    fn long(samples: usize, each: usize) -> Record {
        let cuts = (0..samples).step_by(each);
        let windows = cuts.map(|a| Window { samples: a..(a + each).min(samples), start: vec![a as f64] });
        let data = SystemRecord {
            times: (0..samples).map(|k| k as f64 * 0.1).collect(),
            values: vec![(0..samples).map(|k| k as f64).collect()],
            windows: windows.collect(),
            initial_sample_count: 5,
            ..SystemRecord::default()
        };
        Record { weight: vec![vec![1.0; samples]], ..Record::unweighted(data) }
    }

    #[test]
    fn every_window_is_in_one_block_with_its_samples() {
        let (blocks, recordings) = split_into_blocks(vec![long(1000, 10)], 1);
        assert_eq!(blocks.len(), 20);
        assert_eq!(recordings.len(), 1);
        for (block, first) in &recordings[0].parts {
            assert_eq!(blocks[*block].data.values[0][0], *first as f64);
        }
        let mut found: Vec<f64> = Vec::new();
        for b in &blocks {
            assert_eq!(b.data.times.len(), 50);
            for w in &b.data.windows {
                assert_eq!(b.data.values[0][w.samples.start], w.start[0]);
                found.push(w.start[0]);
            }
        }
        found.sort_by(f64::total_cmp);
        assert_eq!(found, (0..100).map(|k| 10.0 * f64::from(k)).collect::<Vec<_>>());
        assert!(!blocks[0].data.is_mid_motion && blocks[1].data.is_mid_motion);
    }

    #[test]
    fn many_records_and_single_windows_stay_whole() {
        let (records, recordings) = split_into_blocks(vec![long(100, 10); 8], 1);
        assert_eq!((records.len(), recordings.len()), (8, 8));
        let (records, recordings) = split_into_blocks(vec![long(100, 100)], 1);
        assert_eq!((records.len(), recordings.len()), (1, 0));
    }

    #[test]
    fn every_group_with_few_records_has_four_blocks() {
        let records: Vec<Record> = (0..10)
            .map(|group| {
                let mut record = long(100, 10);
                record.data.group = group;
                record
            })
            .collect();
        assert_eq!(split_into_blocks(records.clone(), 10).0.len(), 40);
        assert_eq!(split_into_blocks(records, 1).0.len(), 10, "without groups they stay whole");
    }

    #[test]
    fn few_records_share_twenty_blocks() {
        let (blocks, recordings) = split_into_blocks(vec![long(100, 10); 6], 1);
        assert_eq!((blocks.len(), recordings.len()), (18, 6));
    }

    #[test]
    fn a_recording_of_more_than_ten_thousand_samples_is_several() {
        let recordings = |samples: usize| split_into_blocks(vec![long(samples, 400)], 1).1.len();
        assert_eq!([8_000, 12_000].map(recordings), [1, 2]);
    }
}
