//! Splits training records into segments, and holds out a part of them.

use crate::sequences::{Sequence, Sequences};

/// Number of intervals of a training segment, which has one latent.
/// 64 to 256 intervals made no visible difference on the test systems whose truth was hidden from the program.
const INTERVALS: usize = 128;
/// Every n-th record is held out; if there are fewer than n records, the last 1/n of each.
const HOLD_OUT_STRIDE: usize = 5;
/// Minimum number of intervals of the end of a record for it to be held out.
const MIN_HELD_OUT_INTERVALS: usize = 20;

/// Segments of records to train on, and held-out records.
#[derive(Debug)]
pub(crate) struct Segments {
    pub train: Sequences,
    pub held_out: Vec<Sequence>,
}

/// Splits records into segments; without `hold_out` all of them are for training.
pub(crate) fn split_records(records: &Sequences, hold_out: bool) -> Segments {
    let (mut train, mut held_out) = (Vec::new(), Vec::new());
    let has_enough_records = records.items.len() >= HOLD_OUT_STRIDE;
    for (i, q) in records.items.iter().enumerate() {
        let training_intervals = q.time - 1 - (q.time - 1) / HOLD_OUT_STRIDE;
        if hold_out && has_enough_records && i % HOLD_OUT_STRIDE == HOLD_OUT_STRIDE - 1 {
            held_out.push(q.clone());
        } else if hold_out && !has_enough_records && q.time - 1 - training_intervals >= MIN_HELD_OUT_INTERVALS
        {
            held_out.push(slice(q, training_intervals, q.time - 1, "held out"));
            split_into_segments(q, training_intervals, &mut train);
        } else {
            split_into_segments(q, q.time - 1, &mut train);
        }
    }
    let (columns, action_columns) = (records.columns.clone(), records.action_columns.clone());
    Segments { train: Sequences { columns, action_columns, items: train }, held_out }
}

/// Splits the first `intervals` of a record into segments of nearly equal length.
fn split_into_segments(q: &Sequence, intervals: usize, out: &mut Vec<Sequence>) {
    let count = (intervals as f64 / INTERVALS as f64).round().max(1.0) as usize;
    for k in 0..count {
        let [first, last] = [k, k + 1].map(|k| k * intervals / count);
        if last > first {
            out.push(slice(q, first, last, &k.to_string()));
        }
    }
}

/// Copies the samples `first..=last` of a record.
fn slice(q: &Sequence, first: usize, last: usize, name: &str) -> Sequence {
    let rows = |values: &[f64]| {
        let width = values.len() / q.time;
        values[first * width..(last + 1) * width].to_vec()
    };
    Sequence {
        id: format!("{} {name}", q.id),
        time: last + 1 - first,
        states: rows(&q.states),
        actions: rows(&q.actions),
    }
}

#[cfg(test)]
mod tests {
    //! Contract: training segments cover the training part without gaps and contain nothing held out.
    use super::*;

    fn record(id: usize, time: usize) -> Sequence {
        let states = (0..time).map(|t| (1000 * id + t) as f64).collect();
        Sequence { id: id.to_string(), time, states, actions: Vec::new() }
    }

    fn set(items: Vec<Sequence>) -> Sequences {
        Sequences { columns: vec!["x".into()], action_columns: Vec::new(), items }
    }

    #[test]
    fn the_end_of_a_single_record_is_held_out() {
        let split = split_records(&set(vec![record(0, 1001)]), true);
        let (first, last) = (&split.train.items[0], &split.train.items[split.train.items.len() - 1]);
        assert_eq!((first.states[0], last.states[last.time - 1]), (0.0, 800.0));
        for pair in split.train.items.windows(2) {
            assert_eq!(pair[0].states.last(), pair[1].states.first());
            assert!((64..=256).contains(&pair[0].time));
        }
        assert_eq!((split.held_out[0].states[0], split.held_out[0].time), (800.0, 201));
    }

    #[test]
    fn every_fifth_of_many_records_is_held_out() {
        let split = split_records(&set((0..11).map(|id| record(id, 50)).collect()), true);
        let names: Vec<&str> = split.held_out.iter().map(|q| q.id.as_str()).collect();
        assert_eq!((names, split.train.items.len()), (vec!["4", "9"], 9));
    }

    #[test]
    fn a_short_record_is_used_whole_for_training() {
        let split = split_records(&set(vec![record(0, 40)]), true);
        assert_eq!((split.train.items[0].time, split.held_out.len()), (40, 0));
    }
}
