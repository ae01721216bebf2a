//! Rates and their derivatives at one point.

use super::block::{Block, Drive};
use crate::compile::Section;
use crate::system::{Column, System};

/// Where to look: values of states, inputs and parameters, and seconds since the trajectory began.
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

/// Rates at a point, per second.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearised {
    /// Change of each state per second.
    pub rates: Vec<f64>,
    /// Their derivatives with respect to states, `[rate][state]`.
    pub by_state: Vec<f64>,
    /// Their derivatives with respect to active parameters, `[rate][active]`.
    pub by_parameter: Vec<f64>,
}

impl System {
    /// Outputs without noise at points, `[point][output]`.
    pub fn outputs_at<'p>(&self, points: impl IntoIterator<Item = Point<'p>>) -> Vec<f64> {
        self.values_at(&self.outputs, self.model.outputs.len(), points)
    }

    /// Value of each event's `when` at points, `[point][event]`.
    pub fn conditions_at<'p>(&self, points: impl IntoIterator<Item = Point<'p>>) -> Vec<f64> {
        self.values_at(&self.conditions, self.model.events.len(), points)
    }

    /// The first `count` results of a program at points. Lists of the wrong length are cut, or filled with 0.
    fn values_at<'p>(
        &self,
        section: &Section,
        count: usize,
        points: impl IntoIterator<Item = Point<'p>>,
    ) -> Vec<f64> {
        let mut block = Block::<1>::new(self, 0);
        let mut drive = Drive::<1>::new(self.model.inputs.len());
        let mut prepared: Option<&[f64]> = None;
        let mut values = Vec::new();
        for point in points {
            if prepared != Some(point.parameters) {
                let known = point.parameters.len().min(self.model.parameters.len());
                block.set_parameters(self, 0, &point.parameters[..known]);
                block.prepare(self);
                prepared = Some(point.parameters);
            }
            block.x.iter_mut().zip(point.state).for_each(|(to, x)| to[0] = *x);
            drive.begin[0] = point.time;
            drive.coefficients.iter_mut().zip(point.inputs).for_each(|(c, u)| c[0][0] = *u);
            block.evaluate(self, section, &drive, &[point.time]);
            values.extend(section.results[..count].iter().map(|r| block.registers[*r as usize][0]));
        }
        values
    }

    /// Rates at a point with all their derivatives, by the same operations that simulations run. Lists of the wrong
    /// length are cut, or filled with 0.
    pub fn linearise(&self, point: &Point<'_>) -> Linearised {
        let (n, active) = (self.states(), self.active.len());
        let mut block = Block::<1>::new(self, 0);
        let count = self.model.parameters.len();
        block.set_parameters(self, 0, &point.parameters[..count.min(point.parameters.len())]);
        block.prepare(self);
        block.x.iter_mut().zip(point.state).for_each(|(to, x)| to[0] = *x);
        let mut drive = Drive::<1>::new(self.model.inputs.len());
        drive.begin[0] = point.time;
        drive.coefficients.iter_mut().zip(point.inputs).for_each(|(c, u)| c[0][0] = *u);
        let gradient = &self.rate_gradient;
        block.evaluate(self, &gradient.section, &drive, &[point.time]);
        let mut found = Linearised {
            rates: gradient.section.results[..n].iter().map(|r| block.registers[*r as usize][0]).collect(),
            by_state: vec![0.0; n * n],
            by_parameter: vec![0.0; n * active],
        };
        for entry in &gradient.entries {
            let value = block.registers[entry.register][0];
            match entry.column {
                Column::State(state) => found.by_state[entry.row * n + state] = value,
                Column::Active(k) => found.by_parameter[entry.row * active + k] = value,
                Column::Time => {}
            }
        }
        found
    }
}
