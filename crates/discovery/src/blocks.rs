//! Long records cut into parts, where there are too few records to hold some of them out.
//!
//! A model that is judged on what it was fitted to is not judged. Where a data set is one long record, or a few, their
//! windows are dealt out in blocks of neighbours (blocked cross-validation, Burman, Chow and Nolan 1994), each of which is
//! forecast from its own first samples.

use crate::record::Record;
use augsim_physics::system::{Record as Seen, Window};
use std::ops::Range;

/// Records from which on they are dealt out whole.
const ENOUGH_RECORDS: usize = 8;
/// Blocks that few records are cut into, together.
const BLOCKS: usize = 20;
/// Part of a block that a forecast begins from, at most so many samples.
const KNOWN: (usize, usize) = (20, 50);

/// The records themselves, or their blocks where they are few and have several windows.
pub(crate) fn divided(records: Vec<Record>) -> Vec<Record> {
    let windows: usize = records.iter().map(|r| r.seen.windows.len()).sum();
    if records.len() >= ENOUGH_RECORDS || windows < 2 * records.len().max(1) {
        return records;
    }
    let mut out = Vec::new();
    for record in &records {
        let own = record.seen.windows.len();
        let blocks = ((BLOCKS * own) as f64 / windows as f64).round().clamp(1.0, own as f64) as usize;
        let first = |block: usize| block * own / blocks;
        out.extend((0..blocks).map(|b| block(record, first(b)..first(b + 1))));
    }
    out
}

/// The part of a record that consists of some of its windows.
fn block(record: &Record, windows: Range<usize>) -> Record {
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
            known: (samples / KNOWN.0).clamp(seen.known.min(KNOWN.1), KNOWN.1).min(samples),
            under_way: seen.under_way || first > 0,
        },
        weight: record.weight.iter().map(part).collect(),
        tolerated: record.tolerated,
    }
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
        let blocks = divided(vec![long(1000, 10)]);
        assert_eq!(blocks.len(), 20);
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
        assert_eq!(divided(vec![long(100, 10); 8]).len(), 8);
        assert_eq!(divided(vec![long(100, 100)]).len(), 1);
    }
}
