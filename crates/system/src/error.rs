//! Errors of systems and of their simulations.

use crate::schema::Schema;
use std::error::Error as StdError;
use thiserror::Error;

/// Error: a window cannot be simulated at the values of its task.
#[derive(Debug, Error)]
pub enum SimulationError {
    /// The task does not match the system, such as a wrong number of values or a seed out of range.
    #[error("the {system} system takes {expected} {part}, and the task has {found}")]
    Task {
        /// Name of the simulated system.
        system: String,
        /// Name of the part of the task that does not match.
        part: &'static str,
        /// Number of values that the system takes in this part.
        expected: usize,
        /// Number of values that the task has in this part.
        found: usize,
    },
    /// The simulation diverged.
    #[error(
        "the simulation of the {system} system diverged at t = {time_s} s (non-finite state); check the model's parameters"
    )]
    NotFinite {
        /// Name of the simulated system.
        system: String,
        /// Time at which the state was no longer finite (infinite or NaN), s.
        time_s: f64,
    },
    /// The integrator exceeded its step limit: the equations are stiff or discontinuous.
    #[error(
        "the {system} system needs more than {steps} integration steps by t = {time_s} s; its equations are stiff or discontinuous: \
         check the parameters, or declare the discontinuity as an event"
    )]
    Steps {
        /// Name of the simulated system.
        system: String,
        /// Maximum number of integration steps, which was exceeded.
        steps: usize,
        /// Time that the simulation reached, s.
        time_s: f64,
    },
    /// The simulation exceeded its event limit.
    #[error(
        "the {system} system passes more than {events} events by t = {time_s} s; declare a rest condition"
    )]
    Events {
        /// Name of the simulated system.
        system: String,
        /// Maximum number of events, which was exceeded.
        events: usize,
        /// Time that the simulation reached, s.
        time_s: f64,
    },
    /// The engine of the system reports an error of its own.
    #[error(transparent)]
    Engine(Box<dyn StdError + Send + Sync>),
}

impl SimulationError {
    /// Error of a task in `simulate_batch` that has no output: there are more `tasks` than outputs (`places`).
    pub fn missing_output(schema: &Schema, tasks: usize, places: usize) -> Self {
        let system = schema.system.clone();
        Self::Task { system, part: "outputs", expected: tasks, found: places }
    }
}

/// Error: an effect or table cannot be added to a system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum SystemError {
    /// The index of the effect is outside the system's library.
    #[error("the library has {count} effects; index {index} is out of range")]
    Effect {
        /// Requested index of an effect.
        index: usize,
        /// Number of effects in the library.
        count: usize,
    },
    /// The system would exceed its limit of parameters, states or operations.
    #[error(
        "no further effect can be added to this system: it would have too many parameters, states or operations"
    )]
    Full,
    /// The system has no table for this target and feature.
    #[error("this system has no table that adds to target {target} as a function of feature {against}")]
    Table {
        /// Requested index of a target.
        target: usize,
        /// Requested index of a feature.
        against: usize,
    },
}

/// Error: some data cannot be used. The message is one sentence that says what to do.
#[derive(Debug, Error)]
#[error(transparent)]
pub struct Objection(Box<dyn StdError + Send + Sync>);

impl Objection {
    /// Wraps an error of a system that rejects data.
    pub fn new(error: impl StdError + Send + Sync + 'static) -> Self {
        Self(Box::new(error))
    }
}
