//! A candidate experiment: shapes of the inputs and starts, and its record without measurements.

use crate::explanation::Explanation;
use crate::limits::Limits;
use crate::shape::Shape;
use augsim_system::{InitialValue, Record, Stream};
use rand::{Rng, RngExt};
use std::collections::BTreeMap;

/// A candidate experiment as coordinates between 0 and 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Shape of each input, in the order of the limits.
    pub inputs: Vec<Shape>,
    /// Coordinates of the initial values, in the order of the limits.
    pub starts: Vec<f64>,
}

/// An experiment: sample times, inputs and initial values.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Sample times, s.
    pub times: Vec<f64>,
    /// Values of each input at the sample times, `[input][sample]`.
    pub inputs: Vec<Vec<f64>>,
    /// Initial values of states that are set, by name.
    pub starts: BTreeMap<String, f64>,
}

impl Candidate {
    /// Draws a candidate.
    pub fn random(limits: &Limits, rng: &mut impl Rng) -> Self {
        let inputs = limits.inputs.iter().map(|_| Shape::random(rng)).collect();
        Self { inputs, starts: limits.starts.iter().map(|_| rng.random::<f64>()).collect() }
    }

    /// The experiment of this candidate with deviations of the inputs from rest multiplied by `scale`.
    pub fn experiment(&self, limits: &Limits, scale: f64) -> Experiment {
        let times = limits.times();
        let input = |(limits_of_input, shape): (&crate::limits::InputLimits, &Shape)| {
            let mut values = shape.values(&times, limits_of_input.range);
            limits_of_input.apply(&mut values, scale, limits.step_s);
            values
        };
        let inputs = limits.inputs.iter().zip(&self.inputs).map(input).collect();
        let starts = limits
            .starts
            .iter()
            .zip(&self.starts)
            .map(|((name, [low, high]), q)| (name.clone(), low + (high - low) * q));
        Experiment { inputs, starts: starts.collect(), times }
    }

    /// Moves the coordinate with the index `place` by `change`, within 0 to 1. Returns whether it moved.
    pub(crate) fn move_coordinate(&mut self, place: usize, change: f64) -> bool {
        let coordinate = self.coordinates().swap_remove(place);
        let moved = (*coordinate + change).clamp(0.0, 1.0);
        std::mem::replace(coordinate, moved) != moved
    }

    /// All coordinates of the candidate, in a fixed order.
    pub(crate) fn coordinates(&mut self) -> Vec<&mut f64> {
        self.inputs.iter_mut().flat_map(|shape| shape.q.iter_mut()).chain(self.starts.iter_mut()).collect()
    }
}

impl Experiment {
    /// Record of the experiment without measurements.
    pub fn record(&self, id: &str) -> Record {
        let stream = |values: &Vec<f64>| Stream { times: self.times.clone(), values: vec![values.clone()] };
        Record {
            id: id.to_owned(),
            times: self.times.clone(),
            inputs: self.inputs.iter().map(stream).collect(),
            ..Record::default()
        }
    }

    /// Initial value of each state of an explanation: as set, as declared by a prior, or else the `rough` one.
    pub(crate) fn start_of(&self, explanation: &Explanation, rough: &[f64]) -> Vec<f64> {
        let value = |(state, rough): (&augsim_system::State, &f64)| {
            let set = self.starts.get(&state.quantity.name).copied();
            set.unwrap_or(match state.initial {
                InitialValue::Fixed(value) | InitialValue::Prior(value, _) => value,
                _ => *rough,
            })
        };
        explanation.system.schema().states.iter().zip(rough).map(value).collect()
    }
}
