//! Starts, times and inputs that do not fit the model that they are given to.

use super::unknown::all_or_none;
use augsim_data::{shown, shown_list};
use augsim_physics::system::Objection;
use std::fmt;

/// Why a model cannot be simulated from what is given.
#[derive(Debug)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum PlanFault {
    /// No trajectory.
    NoStart,
    /// Starts of fewer or more trajectories than others.
    StartCount { name: String, found: usize, others: usize },
    /// A start that is no number.
    StartValue { name: String, at: usize, value: f64 },
    /// A start of something that is no state.
    UnknownState { name: String, states: Vec<String> },
    /// A state without a start.
    MissingState { name: String, states: Vec<String> },
    /// The system does not open with these starts.
    Objection(Objection),
    /// No time.
    NoTimes,
    /// A time that is no number, or not later than the one before.
    Time { at: usize, value: f64 },
    /// An input that the model does not have.
    UnknownInput { name: String, inputs: Vec<String> },
    /// An input of the model that is not given.
    MissingInput { name: String, inputs: Vec<String> },
    /// An input with fewer or more values than times.
    InputCount { name: String, found: usize, times: usize },
    /// An input that is no number.
    InputValue { name: String, at: usize, value: f64 },
    /// A pose of other than three numbers.
    Pose { found: usize },
    /// First states and actions that are not of the shape that was said.
    Shape,
}

impl fmt::Display for PlanFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PlanFault::NoStart => f.write_str("start: no trajectory; give the first value of every state"),
            PlanFault::StartCount { name, found, others } => {
                write!(f, "start `{}`: {found} values, but others have {others}", shown(name))
            }
            PlanFault::StartValue { name, at, value } => {
                write!(f, "start `{}`: value {at} is {value}; give a finite number", shown(name))
            }
            PlanFault::UnknownState { name, states } => {
                let (name, states) = (shown(name), shown_list(states));
                write!(f, "start `{name}`: no state of the model; its states are {states}")
            }
            PlanFault::MissingState { name, states } => {
                write!(f, "start: no `{name}`; the states of the model are {}", shown_list(states))
            }
            PlanFault::Objection(objection) => write!(f, "start: {objection}"),
            PlanFault::NoTimes => {
                f.write_str("times: there are none; give the times of the samples in seconds")
            }
            PlanFault::Time { at, value } => {
                write!(f, "times: number {at} is {value}; times are finite and increase")
            }
            PlanFault::UnknownInput { name, inputs } => {
                let (name, inputs) = (shown(name), all_or_none(inputs));
                write!(f, "input `{name}`: the model has no such input; it has {inputs}")
            }
            PlanFault::MissingInput { name, inputs } => {
                write!(f, "inputs: no `{name}`; the inputs of the model are {}", all_or_none(inputs))
            }
            PlanFault::InputCount { name, found, times } => {
                write!(f, "input `{name}`: {found} values for {times} times; give one each")
            }
            PlanFault::InputValue { name, at, value } => {
                write!(f, "input `{name}`: value {at} is {value}; give a finite number")
            }
            PlanFault::Pose { found } => {
                write!(f, "start: {found} numbers; give x_m, y_m, theta_rad")
            }
            PlanFault::Shape => f.write_str("start and actions: not of the shape that is said"),
        }
    }
}
