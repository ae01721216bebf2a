//! The task of a simulation and its result.

use super::{Method, Signal, SimulationError};

/// A recording: times at which outputs are wanted, and inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    pub(crate) name: String,
    pub(crate) times: Vec<f64>,
    pub(crate) inputs: Vec<Signal>,
    /// Whether all inputs are sampled when the outputs are, so that an interval needs no search.
    pub(crate) is_aligned: bool,
}

impl Record {
    /// `name` is for messages, such as "trajectory 3"; `times` in seconds, rising; `inputs` in the order of the model.
    ///
    /// # Errors
    /// [`SimulationError::TimesDoNotRise`].
    pub fn new(name: &str, times: Vec<f64>, inputs: Vec<Signal>) -> Result<Record, SimulationError> {
        if let Some(pair) =
            times.windows(2).find(|pair| pair[1] <= pair[0] || pair[1].is_nan() || pair[0].is_nan())
        {
            let (left, right) = (pair[0], pair[1]);
            return Err(SimulationError::TimesDoNotRise { record: name.into(), left, right });
        }
        let is_aligned = inputs.iter().all(|input| input.knots() == times);
        Ok(Record { name: name.into(), times, inputs, is_aligned })
    }

    /// Times of the samples, in seconds.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Inputs in the order of the model.
    pub fn inputs(&self) -> &[Signal] {
        &self.inputs
    }
}

/// Some samples of a record, simulated from a state at the first of them.
#[derive(Debug, Clone)]
pub struct Window<'a> {
    /// The record.
    pub record: &'a Record,
    /// First and last sample; both are simulated.
    pub first: usize,
    /// See `first`.
    pub last: usize,
    /// State at the first sample.
    pub start: &'a [f64],
    /// Values of all parameters of the model.
    pub parameters: &'a [f64],
}

/// The number that a derivative is with respect to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seed {
    /// A parameter, by its index in the model; it must be active in the compiled system.
    Parameter(usize),
    /// A state at the first sample of the window.
    Start(usize),
}

/// How to simulate.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Method of integration.
    pub method: Method,
    /// Steps of a sample interval.
    pub substeps: usize,
}

/// An event that was simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EventSeen {
    /// Index into the events of the model.
    pub event: usize,
    /// Seconds since the trajectory began.
    pub time: f64,
    /// Whether the condition barely passed 0, so that derivatives are not to be trusted.
    pub grazing: bool,
    /// Whether the system rests from then on.
    pub rests: bool,
}

/// A simulated window.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Simulated {
    /// Outputs, `[sample][output]`.
    pub values: Vec<f64>,
    /// Derivatives of the outputs, `[sample][output][seed]`.
    pub slopes: Vec<f64>,
    /// State at the last sample.
    pub end: Vec<f64>,
    /// Derivatives of that state, `[state][seed]`.
    pub end_slopes: Vec<f64>,
    /// Events in their order.
    pub events: Vec<EventSeen>,
}
