//! Why a system cannot do what it is asked.

use super::Schema;
use std::error::Error as StdError;
use thiserror::Error;

/// A window that cannot be simulated at the values of its task.
#[derive(Debug, Error)]
pub enum SimulationError {
    /// The task does not fit the system: too few values, a seed that names nothing.
    #[error("the {system} system takes {expected} {part}, and the task has {found}")]
    Task {
        /// Name of the system.
        system: String,
        /// Which part of the task.
        part: &'static str,
        /// How many the system takes.
        expected: usize,
        /// How many the task has.
        found: usize,
    },
    /// The numbers are no longer finite.
    #[error(
        "the simulation of the {system} system left the finite numbers at t = {time_s} s; check the model's parameters"
    )]
    NotFinite {
        /// Name of the system.
        system: String,
        /// When, s.
        time_s: f64,
    },
    /// The equations are too stiff or too rough for the steps that are allowed.
    #[error(
        "the {system} system needs more than {steps} integration steps by t = {time_s} s; its equations are stiff or have a jump: \
         check the parameters, or make the jump an event"
    )]
    Steps {
        /// Name of the system.
        system: String,
        /// How many steps are allowed.
        steps: usize,
        /// How far they led, s.
        time_s: f64,
    },
    /// Events without end.
    #[error(
        "the {system} system passes more than {events} events by t = {time_s} s; say when it comes to rest"
    )]
    Events {
        /// Name of the system.
        system: String,
        /// How many events are allowed.
        events: usize,
        /// How far they led, s.
        time_s: f64,
    },
    /// Error of the engine of a system, in its own words.
    #[error(transparent)]
    Engine(Box<dyn StdError + Send + Sync>),
}

impl SimulationError {
    /// The refusal of a task without a place in the results of `simulate_all`, which got so many tasks and places.
    pub fn no_place(schema: &Schema, tasks: usize, places: usize) -> Self {
        let system = schema.system.clone();
        Self::Task { system, part: "places for results", expected: tasks, found: places }
    }
}

/// A law that a system does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum SystemError {
    /// No such effect.
    #[error("the library has {count} effects, and none of index {index}")]
    Effect {
        /// The index that was asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// The system would have more parameters, states or operations than it can.
    #[error("no further law fits into this system: it would have too many parameters, states or operations")]
    Full,
    /// No table of this target and feature.
    #[error("no table can add to target {target} as a function of feature {against} in this system")]
    Table {
        /// Index of the target.
        target: usize,
        /// Index of the feature.
        against: usize,
    },
}

/// Why no answer can come of some data, in one sentence that says what to do.
#[derive(Debug, Error)]
#[error(transparent)]
pub struct Objection(Box<dyn StdError + Send + Sync>);

impl Objection {
    /// The objection of a system, as its own error says it.
    pub fn new(error: impl StdError + Send + Sync + 'static) -> Self {
        Self(Box::new(error))
    }
}
