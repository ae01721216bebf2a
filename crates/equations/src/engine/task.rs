//! Input and result of a simulation by the engine.

use super::{Method, Signal, SimulationError};
use std::sync::Arc;

/// A recording in the form of the engine: times of the samples, and inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    pub(crate) name: String,
    pub(crate) times: Vec<f64>,
    /// Inputs in the order of the model, which records of the same recording share.
    pub(crate) inputs: Arc<[Signal]>,
    /// Whether all inputs are sampled at the output times, so that no sample interval needs a search for input knots.
    pub(crate) is_aligned: bool,
}

impl Record {
    /// Creates a record from sample times (s) and inputs in the order of the model.
    ///
    /// `name` identifies it in messages, such as "trajectory 3".
    ///
    /// # Errors
    /// [`SimulationError::TimesDoNotIncrease`].
    pub fn new(name: &str, times: Vec<f64>, inputs: Vec<Signal>) -> Result<Record, SimulationError> {
        Self::with_inputs(name, times, inputs.into())
    }

    /// A record of the same recording with other sample times, s.
    ///
    /// # Errors
    /// [`SimulationError::TimesDoNotIncrease`].
    pub(super) fn at_times(&self, times: Vec<f64>) -> Result<Record, SimulationError> {
        Self::with_inputs(&self.name, times, self.inputs.clone())
    }

    fn with_inputs(name: &str, times: Vec<f64>, inputs: Arc<[Signal]>) -> Result<Record, SimulationError> {
        if let Some(pair) =
            times.windows(2).find(|pair| pair[1] <= pair[0] || pair[1].is_nan() || pair[0].is_nan())
        {
            let (left, right) = (pair[0], pair[1]);
            return Err(SimulationError::TimesDoNotIncrease { record: name.into(), left, right });
        }
        let is_aligned = inputs.iter().all(|input| input.knots() == times);
        Ok(Record { name: name.into(), times, inputs, is_aligned })
    }

    /// Times of the record's samples, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Inputs of the record, in the order of the model.
    pub fn inputs(&self) -> &[Signal] {
        &self.inputs
    }
}

/// A range of samples of a record, simulated from the state at the first of them.
#[derive(Debug, Clone)]
pub struct Window<'a> {
    /// The record of which the window is a part.
    pub record: &'a Record,
    /// Index of the first sample of the window; it is simulated, as is the last.
    pub first: usize,
    /// Index of the last sample of the window; it is simulated, as is the first.
    pub last: usize,
    /// State at the first sample of the window.
    pub start: &'a [f64],
    /// Values of all parameters of the model.
    pub parameters: &'a [f64],
}

/// Variable with respect to which a simulation is differentiated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seed {
    /// A parameter, by its index in the model; the compiled system must have derivatives with respect to it.
    Parameter(usize),
    /// A state at the first sample of the window, by its index.
    Start(usize),
}

/// Integration method and number of steps of a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Integration method of the simulation.
    pub method: Method,
    /// Number of integration steps per sample interval.
    pub substeps: usize,
}

/// An event that occurred in a simulated window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulatedEvent {
    /// Index of the event in the model.
    pub event: usize,
    /// Time of the event, seconds since the trajectory began.
    pub time: f64,
    /// Whether the condition barely crossed 0, so that derivatives after the event are not reliable.
    pub is_grazing: bool,
    /// Whether a rest of the system begins with this event.
    pub begins_rest: bool,
}

/// The result of a simulated window.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Simulated {
    /// Outputs at the samples, `[sample][output]`.
    pub values: Vec<f64>,
    /// Derivatives of the outputs with respect to the seeds, `[sample][output][seed]`.
    pub slopes: Vec<f64>,
    /// State at the last sample of the window.
    pub end: Vec<f64>,
    /// Derivatives of the state at the last sample with respect to the seeds, `[state][seed]`.
    pub end_slopes: Vec<f64>,
    /// Events in the window, in the order of time.
    pub events: Vec<SimulatedEvent>,
}
