//! Splits training records into segments, and holds out a part of them.

use crate::sequences::{Sequence, Sequences};

/// Intervals of a segment, which has one latent.
/// 64 to 256 intervals made no visible difference on the sealed test systems.
const INTERVALS: usize = 128;
/// Every n-th record is held out; of fewer than n records, the last 1/n of each.
const ONE_IN: usize = 5;
/// Minimum number of intervals of a held-out end of a record.
const SHORTEST: usize = 20;

/// Segments to train on, and held-out sequences.
#[derive(Debug)]
pub(crate) struct Pieces {
    pub train: Sequences,
    pub held_out: Vec<Sequence>,
}

/// Splits records into segments; without `hold_out` all of them are for training.
pub(crate) fn pieces(all: &Sequences, hold_out: bool) -> Pieces {
    let (mut train, mut held_out) = (Vec::new(), Vec::new());
    let many = all.items.len() >= ONE_IN;
    for (i, q) in all.items.iter().enumerate() {
        let kept = q.time - 1 - (q.time - 1) / ONE_IN;
        if hold_out && many && i % ONE_IN == ONE_IN - 1 {
            held_out.push(q.clone());
        } else if hold_out && !many && q.time - 1 - kept >= SHORTEST {
            held_out.push(part(q, kept, q.time - 1, "held out"));
            cut(q, kept, &mut train);
        } else {
            cut(q, q.time - 1, &mut train);
        }
    }
    let (columns, action_columns) = (all.columns.clone(), all.action_columns.clone());
    Pieces { train: Sequences { columns, action_columns, items: train }, held_out }
}

/// Splits the first `intervals` of a record into segments of nearly equal length.
fn cut(q: &Sequence, intervals: usize, out: &mut Vec<Sequence>) {
    let count = (intervals as f64 / INTERVALS as f64).round().max(1.0) as usize;
    for k in 0..count {
        let [first, last] = [k, k + 1].map(|k| k * intervals / count);
        if last > first {
            out.push(part(q, first, last, &k.to_string()));
        }
    }
}

/// The samples `first..=last` of a record.
fn part(q: &Sequence, first: usize, last: usize, name: &str) -> Sequence {
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
        let cut = pieces(&set(vec![record(0, 1001)]), true);
        let (first, last) = (&cut.train.items[0], &cut.train.items[cut.train.items.len() - 1]);
        assert_eq!((first.states[0], last.states[last.time - 1]), (0.0, 800.0));
        for pair in cut.train.items.windows(2) {
            assert_eq!(pair[0].states.last(), pair[1].states.first());
            assert!((64..=256).contains(&pair[0].time));
        }
        assert_eq!((cut.held_out[0].states[0], cut.held_out[0].time), (800.0, 201));
    }

    #[test]
    fn of_many_records_every_fifth_is_held_out_whole() {
        let cut = pieces(&set((0..11).map(|id| record(id, 50)).collect()), true);
        let names: Vec<&str> = cut.held_out.iter().map(|q| q.id.as_str()).collect();
        assert_eq!((names, cut.train.items.len()), (vec!["4", "9"], 9));
    }

    #[test]
    fn a_short_record_is_learned_from_whole() {
        let cut = pieces(&set(vec![record(0, 40)]), true);
        assert_eq!((cut.train.items[0].time, cut.held_out.len()), (40, 0));
    }
}
