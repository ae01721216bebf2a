//! Initial states, times and inputs of a simulation that do not fit the model.

use super::unknown::names_or_none;
use augsim_data::{escaped_list, escaped_short};
use augsim_system::Objection;
use std::fmt;

/// Why a simulation plan does not fit the model.
#[derive(Debug)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum PlanFault {
    /// The plan has no trajectory.
    NoStart,
    /// A state has initial values for a different number of trajectories than the other states.
    StartCount { name: String, found: usize, others: usize },
    /// An initial value is not finite; `at` is its index.
    StartValue { name: String, at: usize, value: f64 },
    /// An initial value is given for a state that the model does not have.
    UnknownState { name: String, states: Vec<String> },
    /// A state of the model has no initial value.
    MissingState { name: String, states: Vec<String> },
    /// The system refuses these initial values.
    Objection(Objection),
    /// The plan has no sample times.
    NoTimes,
    /// A sample time is not finite, or not later than the previous one; `at` is its index.
    Time { at: usize, value: f64 },
    /// Values are given for an input that the model does not have.
    UnknownInput { name: String, inputs: Vec<String> },
    /// An input of the model is not given.
    MissingInput { name: String, inputs: Vec<String> },
    /// An input has a number of values that differs from the number of times.
    InputCount { name: String, found: usize, times: usize },
    /// An input value is not finite; `at` is its index.
    InputValue { name: String, at: usize, value: f64 },
    /// A pose does not have three numbers.
    Pose { found: usize },
    /// The shape of initial states and actions differs from the stated one.
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
