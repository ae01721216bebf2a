//! A simulation task: window, parameter values, initial state, and variables of differentiation (seeds).

use crate::error::SimulationError;
use crate::record::Record;
use crate::schema::Schema;
use std::ops::Range;

/// A variable of differentiation (seed); each seed of a task has its own lane of derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Seed {
    /// Derivatives are taken with respect to a parameter, by its index in the parameter vector.
    Parameter(usize),
    /// Derivatives are taken with respect to an initial state of the window, by its index in the schema.
    Start(usize),
    /// Derivatives are taken with respect to an offset of the event parameter, by its index in [`Offsets`].
    Offset(usize),
}

/// Offsets added to the event parameter at events: realisations of its random effect.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Offsets<'a> {
    /// The event parameter has no offset at any event.
    #[default]
    None,
    /// The event parameter has the same offset at every event of the window.
    Shared(f64),
    /// Each event has its own offset of the event parameter, in order; 0 beyond the end of the list.
    PerEvent(&'a [f64]),
}

impl Offsets<'_> {
    /// Number of offsets of the event parameter.
    pub fn len(&self) -> usize {
        match self {
            Offsets::None => 0,
            Offsets::Shared(_) => 1,
            Offsets::PerEvent(list) => list.len(),
        }
    }

    /// Whether the event parameter has no offsets.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A window of a record to simulate, with all values that the simulation needs.
#[derive(Clone, Debug)]
pub struct Task<'a> {
    /// Values of the system's parameters, in the order of its parameter vector.
    pub parameters: &'a [f64],
    /// Record that provides times, inputs and covariates.
    pub record: &'a Record,
    /// Range of the record's samples to simulate; a window that does not start at sample 0 starts during the motion.
    pub window: Range<usize>,
    /// Initial state at the first sample of the window, in the order of the schema's states.
    pub start: &'a [f64],
    /// Offsets added to the event parameter at the events of the window.
    pub offsets: Offsets<'a>,
    /// Variables of differentiation, one per lane of derivatives.
    pub seeds: &'a [Seed],
}

impl Task<'_> {
    /// Checks that the task matches a system with this schema and number of parameters.
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
