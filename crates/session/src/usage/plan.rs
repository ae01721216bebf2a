//! Initial states, times and inputs of a simulation that do not fit the model.

use super::unknown::names_or_none;
use augsim_data::{escaped_list, escaped_short};
use augsim_system::Objection;
use std::fmt;

/// Why a simulation plan does not fit the model.
#[derive(Debug)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum PlanFault {
    /// No trajectory.
    NoStart,
    /// Initial values for a different number of trajectories than the others.
    StartCount { name: String, found: usize, others: usize },
    /// An initial value that is not finite.
    StartValue { name: String, at: usize, value: f64 },
    /// An initial value of an unknown state.
    UnknownState { name: String, states: Vec<String> },
    /// A state without an initial value.
    MissingState { name: String, states: Vec<String> },
    /// The system refuses these initial values.
    Objection(Objection),
    /// No times.
    NoTimes,
    /// A time that is not finite, or not later than the previous one.
    Time { at: usize, value: f64 },
    /// An unknown input.
    UnknownInput { name: String, inputs: Vec<String> },
    /// An input of the model that is not given.
    MissingInput { name: String, inputs: Vec<String> },
    /// An input whose number of values differs from that of the times.
    InputCount { name: String, found: usize, times: usize },
    /// An input value that is not finite.
    InputValue { name: String, at: usize, value: f64 },
    /// A pose that does not have three numbers.
    Pose { found: usize },
    /// Initial states and actions whose shape differs from the stated one.
    Shape,
}

impl fmt::Display for PlanFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PlanFault::NoStart => f.write_str("start: it is empty; give the initial value of every state"),
            PlanFault::StartCount { name, found, others } => {
                write!(
                    f,
                    "start `{}`: it has {found} values, but the other states have {others}",
                    escaped_short(name)
                )
            }
            PlanFault::StartValue { name, at, value } => {
                write!(f, "start `{}`: value {at} is {value}; give a finite number", escaped_short(name))
            }
            PlanFault::UnknownState { name, states } => {
                let (name, states) = (escaped_short(name), escaped_list(states));
                write!(f, "start `{name}`: this is no state of the model; its states are {states}")
            }
            PlanFault::MissingState { name, states } => {
                write!(f, "start: `{name}` is missing; the states of the model are {}", escaped_list(states))
            }
            PlanFault::Objection(objection) => write!(f, "start: {objection}"),
            PlanFault::NoTimes => {
                f.write_str("times: they are empty; give the times of the samples in seconds")
            }
            PlanFault::Time { at, value } => {
                write!(f, "times: value {at} is {value}; times must be finite and increasing")
            }
            PlanFault::UnknownInput { name, inputs } => {
                let (name, inputs) = (escaped_short(name), names_or_none(inputs));
                write!(f, "input `{name}`: the model has no such input; it has {inputs}")
            }
            PlanFault::MissingInput { name, inputs } => {
                write!(
                    f,
                    "inputs: `{name}` is missing; the inputs of the model are {}",
                    names_or_none(inputs)
                )
            }
            PlanFault::InputCount { name, found, times } => {
                write!(f, "input `{name}`: it has {found} values for {times} times; give one value per time")
            }
            PlanFault::InputValue { name, at, value } => {
                write!(f, "input `{name}`: value {at} is {value}; give a finite number")
            }
            PlanFault::Pose { found } => {
                write!(f, "start: it has {found} numbers; give three: x_m, y_m, theta_rad")
            }
            PlanFault::Shape => {
                f.write_str("start and actions: their length does not match the stated shape")
            }
        }
    }
}
