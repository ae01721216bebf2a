//! Draws of the parameters of an equation model from their joint distribution.

use augsim_equations::{EquationSystem, Model};
use augsim_system::Simulate;

/// Joint normal distribution of the parameters that a fit has estimated.
///
/// Parameters that have a 95 % interval and are not in the `[covariance]` of the model are independent.
#[derive(Debug)]
pub(super) struct ParameterUncertainty {
    /// Indices of the parameters that are in the model's covariance matrix.
    joint: Vec<usize>,
    /// Lower Cholesky factor of the covariance matrix of the parameters in `joint`.
    factor: Vec<Vec<f64>>,
}

impl ParameterUncertainty {
    /// Reads the distribution from the model file; frozen parameters do not vary.
    pub fn new(model: &Model) -> Self {
        let covariance = model.covariance.clone().unwrap_or_default();
        let factor = covariance.factor();
        Self { joint: covariance.parameters, factor }
    }

    /// Draws all parameters about the means `values`, clipped to their bounds.
    pub fn draw(&self, system: &EquationSystem, values: &[f64], normal: &mut dyn FnMut() -> f64) -> Vec<f64> {
        let declared = system.parameters();
        let mut drawn = values.to_vec();
        for (i, p) in declared.iter().enumerate().filter(|(i, _)| !self.joint.contains(i)) {
            drawn[i] += p.standard_deviation().unwrap_or(0.0) * normal();
        }
        let z: Vec<f64> = self.joint.iter().map(|_| normal()).collect();
        for (i, row) in self.joint.iter().zip(&self.factor).filter(|(i, _)| !declared[**i].frozen) {
            drawn[*i] += row.iter().zip(&z).map(|(l, z)| l * z).sum::<f64>();
        }
        drawn
            .iter()
            .zip(values)
            .zip(declared)
            .map(|((drawn, v), p)| drawn.clamp(p.min.min(*v), p.max.max(*v)))
            .collect()
    }
}
