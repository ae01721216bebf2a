//! Errors of systems and of their simulations.

use crate::schema::Schema;
use std::error::Error as StdError;
use thiserror::Error;

/// Why a window cannot be simulated at the values of its task.
#[derive(Debug, Error)]
pub enum SimulationError {
    /// The task does not match the system, such as a wrong number of values or a seed out of range.
    #[error("the {system} system takes {expected} {part}, and the task has {found}")]
    Task {
        /// Name of the system.
        system: String,
        /// The part of the task that does not match.
        part: &'static str,
        /// Number that the system takes.
        expected: usize,
        /// Number that the task has.
        found: usize,
    },
    /// The simulation diverged.
    #[error(
        "the simulation of the {system} system diverged at t = {time_s} s (non-finite state); check the model's parameters"
    )]
    NotFinite {
        /// Name of the system.
        system: String,
        /// Time at which the state was no longer finite, s.
        time_s: f64,
    },
    /// The integrator exceeded its step limit: the equations are stiff or discontinuous.
    #[error(
        "the {system} system needs more than {steps} integration steps by t = {time_s} s; its equations are stiff or discontinuous: \
         check the parameters, or declare the discontinuity as an event"
    )]
    Steps {
        /// Name of the system.
        system: String,
        /// Largest number of steps.
        steps: usize,
        /// Time reached, s.
        time_s: f64,
    },
    /// The simulation exceeded its event limit.
    #[error(
        "the {system} system passes more than {events} events by t = {time_s} s; declare a rest condition"
    )]
    Events {
        /// Name of the system.
        system: String,
        /// Largest number of events.
        events: usize,
        /// Time reached, s.
        time_s: f64,
    },
    /// Error of a system's engine.
    #[error(transparent)]
    Engine(Box<dyn StdError + Send + Sync>),
}

impl SimulationError {
    /// The error of `simulate_batch` if there are more `tasks` than outputs (`places`).
    pub fn missing_output(schema: &Schema, tasks: usize, places: usize) -> Self {
        let system = schema.system.clone();
        Self::Task { system, part: "outputs", expected: tasks, found: places }
    }
}

/// Why an effect or table cannot be added to a system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum SystemError {
    /// The index is outside the library.
    #[error("the library has {count} effects; index {index} is out of range")]
    Effect {
        /// The requested index.
        index: usize,
        /// Number of effects.
        count: usize,
    },
    /// The system would exceed its limit of parameters, states or operations.
    #[error(
        "no further effect can be added to this system: it would have too many parameters, states or operations"
    )]
    Full,
    /// There is no table for this target and feature.
    #[error("this system has no table that adds to target {target} as a function of feature {against}")]
    Table {
        /// Index of the target.
        target: usize,
        /// Index of the feature.
        against: usize,
    },
}

/// Why some data cannot be used, as one sentence that says what to do.
#[derive(Debug, Error)]
#[error(transparent)]
pub struct Objection(Box<dyn StdError + Send + Sync>);

impl Objection {
    /// Wraps the error of a system.
    pub fn new(error: impl StdError + Send + Sync + 'static) -> Self {
        Self(Box::new(error))
    }
}
