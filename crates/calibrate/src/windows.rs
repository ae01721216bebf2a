//! Windows of records with the start states that are fitted with them.

use augsim_physics::system::{Begin, Record, Schema, System, spread};
use std::ops::Range;

/// A misfit below this share of what a channel does is none: there is nothing to follow.
pub(crate) const NEGLIGIBLE: f64 = 1e-6;

/// A window and its present start.
#[derive(Clone, Debug)]
pub(crate) struct Shot {
    pub record: usize,
    pub samples: Range<usize>,
    pub start: Vec<f64>,
}

/// Parameters and starts to fit, and the records that they are fitted to.
#[derive(Debug)]
pub(crate) struct Problem<'a> {
    pub system: &'a dyn System,
    pub records: &'a [Record],
    /// Parameters that move, by their places.
    pub free: Vec<usize>,
    /// Start states that move, by their places.
    pub states: Vec<usize>,
}

impl<'a> Problem<'a> {
    pub fn new(system: &'a dyn System, records: &'a [Record], fit_parameters: bool) -> Self {
        let schema = system.schema();
        let parameters = system.parameters().iter().enumerate();
        let free = parameters.filter(|(_, p)| fit_parameters && !p.frozen).map(|(i, _)| i).collect();
        let states = schema.free_states().collect();
        Self { system, records, free, states }
    }

    /// Standard deviation of each channel, the scale that fits begin with, in its unit.
    pub fn spread(&self) -> Vec<f64> {
        (0..self.schema().channels.len()).map(|channel| spread(self.records, channel)).collect()
    }

    pub fn schema(&self) -> &Schema {
        self.system.schema()
    }

    /// Mean and standard deviation that a state is known to begin a record with.
    pub fn prior(&self, shot: &Shot, state: usize) -> Option<(f64, f64)> {
        match self.schema().states.get(state)?.begin {
            Begin::Prior(mean, sd) if shot.samples.start == 0 => Some((mean, sd)),
            _ => None,
        }
    }

    /// The windows of the records as they were prepared.
    pub fn shots(&self) -> Vec<Shot> {
        let of = |(record, seen): (usize, &Record)| {
            let windows = seen.windows.iter();
            windows
                .map(move |w| Shot { record, samples: w.samples.clone(), start: w.start.clone() })
                .collect()
        };
        self.records.iter().enumerate().flat_map(|r| -> Vec<Shot> { of(r) }).collect()
    }
}

/// Pairs of neighbours become one window that begins as the first of them does.
pub(crate) fn doubled(shots: &[Shot]) -> Vec<Shot> {
    let mut out: Vec<Shot> = Vec::new();
    let mut joined = false;
    for shot in shots {
        match out.last_mut() {
            Some(last) if last.record == shot.record && !joined => {
                last.samples.end = shot.samples.end;
                joined = true;
            }
            _ => {
                out.push(shot.clone());
                joined = false;
            }
        }
    }
    out
}
