//! One window to simulate, and with respect to what.

use super::{Record, Schema, SimulationError};
use std::ops::Range;

/// The number with respect to which one lane carries derivatives. No two lanes of a task have the same seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Seed {
    /// A parameter, by its place in the vector.
    Parameter(usize),
    /// A state at the beginning of the window, by its place in the schema.
    Start(usize),
    /// An offset of the event's parameter, by its place in [`Offsets`].
    Offset(usize),
}

/// Offsets of the parameter of the schema's events: random numbers that the simulation takes as inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Offsets<'a> {
    /// None.
    #[default]
    None,
    /// One offset for every event of the window.
    Shared(f64),
    /// One for each event, in order; 0 beyond the last.
    Each(&'a [f64]),
}

impl Offsets<'_> {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Offsets::None => 0,
            Offsets::Shared(_) => 1,
            Offsets::Each(list) => list.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A window to simulate.
#[derive(Clone, Debug)]
pub struct Task<'a> {
    /// Values of the system's parameters.
    pub parameters: &'a [f64],
    /// The record: times, inputs and covariates.
    pub record: &'a Record,
    /// Samples of the record. A window that does not begin the record is under way.
    pub window: Range<usize>,
    /// States at the first sample of the window, in the order of the schema.
    pub start: &'a [f64],
    /// Offsets of the event's parameter.
    pub offsets: Offsets<'a>,
    /// The numbers with respect to which derivatives are carried, lane by lane.
    pub seeds: &'a [Seed],
}

impl Task<'_> {
    /// Whether the task fits a system with this schema and so many parameters.
    ///
    /// # Errors
    /// [`SimulationError::Task`] names the part that does not.
    pub fn check(&self, schema: &Schema, parameters: usize) -> Result<(), SimulationError> {
        let offsets = if schema.event.is_some() { self.offsets.len() } else { 0 };
        let ends = |limit: usize, of: fn(Seed) -> Option<usize>| {
            let last = self.seeds.iter().filter_map(|s| of(*s)).max();
            (limit, last.map_or(0, |last| last + 1))
        };
        let parameter = |s: Seed| if let Seed::Parameter(i) = s { Some(i) } else { None };
        let start = |s: Seed| if let Seed::Start(i) = s { Some(i) } else { None };
        let offset = |s: Seed| if let Seed::Offset(i) = s { Some(i) } else { None };
        let exact = [
            ("parameters", parameters, self.parameters.len()),
            ("start states", schema.states.len(), self.start.len()),
            ("input streams", schema.inputs.len(), self.record.inputs.len()),
        ];
        let most = [
            ("samples", (self.record.times.len(), self.window.end)),
            ("seeds of parameters", ends(parameters, parameter)),
            ("seeds of start states", ends(schema.states.len(), start)),
            ("seeds of offsets", ends(offsets, offset)),
        ];
        let wrong = exact.into_iter().find(|(_, expected, found)| expected != found);
        let above = || {
            let beyond = most.into_iter().find(|(_, (limit, found))| found > limit);
            beyond.map(|(part, (limit, found))| (part, limit, found))
        };
        match wrong.or_else(above) {
            None => Ok(()),
            Some((part, expected, found)) => {
                Err(SimulationError::Task { system: schema.system.clone(), part, expected, found })
            }
        }
    }

    /// Times of the window's samples, s.
    pub fn times(&self) -> &[f64] {
        self.record.times.get(self.window.clone()).unwrap_or(&[])
    }
}
