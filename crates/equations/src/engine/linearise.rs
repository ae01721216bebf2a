//! Rates, outputs and event conditions at single points, with the derivatives of the rates.

use super::block::{Block, StepInputs};
use crate::compile::Section;
use crate::system::{Column, System};

/// A point at which a system is evaluated: states, inputs, parameters and time.
#[derive(Debug, Clone, Copy)]
pub struct Point<'a> {
    /// Values of the states, in the order of the model.
    pub state: &'a [f64],
    /// Values of the inputs, in the order of the model.
    pub inputs: &'a [f64],
    /// Values of the parameters, in the order of the model.
    pub parameters: &'a [f64],
    /// Time in seconds since the trajectory began.
    pub time: f64,
}

/// Rates of the states at a point, with the derivatives of the rates.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearisation {
    /// Rate of each state, per second.
    pub rates: Vec<f64>,
    /// Derivatives of the rates with respect to the states, `[rate][state]`.
    pub by_state: Vec<f64>,
    /// Derivatives of the rates with respect to the active parameters, `[rate][active]`.
    pub by_parameter: Vec<f64>,
}

impl System {
    /// Computes noise-free outputs at points, `[point][output]`.
    pub fn outputs_at<'p>(&self, points: impl IntoIterator<Item = Point<'p>>) -> Vec<f64> {
        self.values_at(&self.outputs, self.model.outputs.len(), points)
    }

    /// Computes the condition `when` of each event at points, `[point][event]`.
    pub fn conditions_at<'p>(&self, points: impl IntoIterator<Item = Point<'p>>) -> Vec<f64> {
        self.values_at(&self.conditions, self.model.events.len(), points)
    }

    /// Computes the first `count` results of a section at points.
    ///
    /// Lists of states and inputs that are too long are cut; values missing in them stay those of the point
    /// before. Too many parameters are cut.
    fn values_at<'p>(
        &self,
        section: &Section,
        count: usize,
        points: impl IntoIterator<Item = Point<'p>>,
    ) -> Vec<f64> {
        let mut block = Block::<1>::new(self, 0);
        let mut step_inputs = StepInputs::<1>::new(self.model.inputs.len());
        let mut prepared_for: Option<&[f64]> = None;
        let mut values = Vec::new();
        for point in points {
            if prepared_for != Some(point.parameters) {
                let known = point.parameters.len().min(self.model.parameters.len());
                block.set_parameters(self, 0, &point.parameters[..known]);
                block.prepare(self);
                prepared_for = Some(point.parameters);
            }
            block.x.iter_mut().zip(point.state).for_each(|(to, x)| to[0] = *x);
            step_inputs.begin[0] = point.time;
            step_inputs.coefficients.iter_mut().zip(point.inputs).for_each(|(c, u)| c[0][0] = *u);
            block.evaluate(self, section, &step_inputs, &[point.time]);
            values.extend(section.results[..count].iter().map(|r| block.registers[*r as usize][0]));
        }
        values
    }

    /// Computes the rates at a point with all their derivatives, by the same operations as in simulations.
    ///
    /// Lists of the wrong length in the point are cut, or filled with 0.
    pub fn linearise(&self, point: &Point<'_>) -> Linearisation {
        let (n, active) = (self.states(), self.active.len());
        let mut block = Block::<1>::new(self, 0);
        let count = self.model.parameters.len();
        block.set_parameters(self, 0, &point.parameters[..count.min(point.parameters.len())]);
        block.prepare(self);
        block.x.iter_mut().zip(point.state).for_each(|(to, x)| to[0] = *x);
        let mut step_inputs = StepInputs::<1>::new(self.model.inputs.len());
        step_inputs.begin[0] = point.time;
        step_inputs.coefficients.iter_mut().zip(point.inputs).for_each(|(c, u)| c[0][0] = *u);
        let gradient = &self.rate_gradient;
        block.evaluate(self, &gradient.section, &step_inputs, &[point.time]);
        let mut result = Linearisation {
            rates: gradient.section.results[..n].iter().map(|r| block.registers[*r as usize][0]).collect(),
            by_state: vec![0.0; n * n],
            by_parameter: vec![0.0; n * active],
        };
        for entry in &gradient.entries {
            let value = block.registers[entry.register][0];
            match entry.column {
                Column::State(state) => result.by_state[entry.row * n + state] = value,
                Column::Active(k) => result.by_parameter[entry.row * active + k] = value,
                Column::Time => {}
            }
        }
        result
    }
}
