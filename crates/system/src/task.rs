//! A simulation task: window, parameter values, initial state and derivative seeds.

use crate::error::SimulationError;
use crate::record::Record;
use crate::schema::Schema;
use std::ops::Range;

/// The variable with respect to which one lane carries derivatives; the seeds of a task are distinct.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Seed {
    /// A parameter, by its index in the parameter vector.
    Parameter(usize),
    /// An initial state of the window, by its index in the schema.
    Start(usize),
    /// An offset of the event parameter, by its index in [`Offsets`].
    Offset(usize),
}

/// Offsets of the event parameter: realisations of its random effect, inputs of the simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Offsets<'a> {
    /// No offsets.
    #[default]
    None,
    /// One offset for every event of the window.
    Shared(f64),
    /// One offset per event, in order; 0 beyond the end of the list.
    PerEvent(&'a [f64]),
}

impl Offsets<'_> {
    /// Number of offsets.
    pub fn len(&self) -> usize {
        match self {
            Offsets::None => 0,
            Offsets::Shared(_) => 1,
            Offsets::PerEvent(list) => list.len(),
        }
    }

    /// Whether there are no offsets.
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
    /// Sample range of the record; a window that does not start at sample 0 starts during the motion.
    pub window: Range<usize>,
    /// Initial state at the first sample of the window, in the order of the schema.
    pub start: &'a [f64],
    /// Offsets of the event parameter.
    pub offsets: Offsets<'a>,
    /// Variables of differentiation, one per lane.
    pub seeds: &'a [Seed],
}

impl Task<'_> {
    /// Checks the task against a system with this schema and number of parameters.
    ///
    /// # Errors
    /// [`SimulationError::Task`] names the part that does not match.
    pub fn check(&self, schema: &Schema, parameters: usize) -> Result<(), SimulationError> {
        let offsets = if schema.event.is_some() { self.offsets.len() } else { 0 };
        let seed_count = |limit: usize, index: fn(Seed) -> Option<usize>| {
            let last = self.seeds.iter().filter_map(|s| index(*s)).max();
            (limit, last.map_or(0, |last| last + 1))
        };
        let parameter = |s: Seed| if let Seed::Parameter(i) = s { Some(i) } else { None };
        let start = |s: Seed| if let Seed::Start(i) = s { Some(i) } else { None };
        let offset = |s: Seed| if let Seed::Offset(i) = s { Some(i) } else { None };
        let exact = [
            ("parameters", parameters, self.parameters.len()),
            ("initial states", schema.states.len(), self.start.len()),
            ("input streams", schema.inputs.len(), self.record.inputs.len()),
        ];
        let upper_limits = [
            ("samples", (self.record.times.len(), self.window.end)),
            ("seeds of parameters", seed_count(parameters, parameter)),
            ("seeds of initial states", seed_count(schema.states.len(), start)),
            ("seeds of offsets", seed_count(offsets, offset)),
        ];
        let wrong = exact.into_iter().find(|(_, expected, found)| expected != found);
        let over_limit = || {
            let beyond = upper_limits.into_iter().find(|(_, (limit, found))| found > limit);
            beyond.map(|(part, (limit, found))| (part, limit, found))
        };
        match wrong.or_else(over_limit) {
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
