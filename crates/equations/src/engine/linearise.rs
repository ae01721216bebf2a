//! Rates, outputs and event conditions at single points, with the derivatives of the rates.

use super::block::{Block, StepInputs};
use crate::compile::Section;
use crate::system::{Column, System};

/// Values of states, inputs, parameters and time at which a system is evaluated.
#[derive(Debug, Clone, Copy)]
pub struct Point<'a> {
    /// States in the order of the model.
    pub state: &'a [f64],
    /// Inputs in the order of the model.
    pub inputs: &'a [f64],
    /// Parameters in the order of the model.
    pub parameters: &'a [f64],
    /// Seconds since the trajectory began.
    pub time: f64,
}

/// Rates at a point with their derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearisation {
    /// Rate of each state.
    pub rates: Vec<f64>,
    /// Derivatives of the rates with respect to the states, `[rate][state]`.
    pub by_state: Vec<f64>,
    /// Derivatives of the rates with respect to the active parameters, `[rate][active]`.
    pub by_parameter: Vec<f64>,
}

impl System {
    /// Noise-free outputs at points, `[point][output]`.
    pub fn outputs_at<'p>(&self, points: impl IntoIterator<Item = Point<'p>>) -> Vec<f64> {
        self.values_at(&self.outputs, self.model.outputs.len(), points)
    }

    /// Values of the `when` of each event at points, `[point][event]`.
    pub fn conditions_at<'p>(&self, points: impl IntoIterator<Item = Point<'p>>) -> Vec<f64> {
        self.values_at(&self.conditions, self.model.events.len(), points)
    }

    /// The first `count` results of a section at points.
    ///
    /// States and inputs of the wrong length are cut or keep the values before; too many parameters are cut.
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

    /// Rates at a point with all their derivatives, by the same operations as in simulations.
    ///
    /// Lists of the wrong length are cut, or filled with 0.
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
