//! Draws of the parameters of an equation model from their joint distribution.

use augsim_equations::model::Parameter;
use augsim_equations::{EquationSystem, Model};
use augsim_system::{Record, Simulate};

/// Joint normal distribution of the parameters that a fit has estimated.
///
/// Parameters that have a 95 % interval and are not in the `[covariance]` of the model are independent.
#[derive(Debug)]
pub(super) struct ParameterUncertainty {
    /// Indices of the parameters that are in the model's covariance matrix.
    joint: Vec<usize>,
    /// Lower Cholesky factor of the covariance matrix of the parameters in `joint`.
    factor: Vec<Vec<f64>>,
    /// Index of each parameter with a distribution over groups, and its standard deviation over them.
    over_groups: Vec<(usize, f64)>,
    /// Number of groups for which the model has values.
    groups: usize,
}

impl ParameterUncertainty {
    /// Reads the distribution from the model file; frozen parameters do not vary.
    pub fn new(model: &Model) -> Self {
        let covariance = model.covariance.clone().unwrap_or_default();
        let factor = covariance.factor();
        let sd = |(i, p): (usize, &Parameter)| Some((i, p.by_group.as_ref()?.sd?));
        let over_groups = model.parameters.iter().enumerate().filter_map(sd).collect();
        Self { joint: covariance.parameters, factor, over_groups, groups: model.group_names().len() }
    }

    /// Draws all parameters about the means `values`, clipped to their bounds.
    ///
    /// For a record of a group that the model does not know, parameters with values by group are drawn from their
    /// distribution over groups.
    pub fn draw(
        &self,
        system: &EquationSystem,
        record: &Record,
        values: &[f64],
        normal: &mut dyn FnMut() -> f64,
    ) -> Vec<f64> {
        let declared = system.parameters();
        let mut drawn = values.to_vec();
        for (i, p) in declared.iter().enumerate().filter(|(i, _)| !self.joint.contains(i)) {
            drawn[i] += p.standard_deviation().unwrap_or(0.0) * normal();
        }
        if record.group >= self.groups {
            self.over_groups.iter().for_each(|(i, sd)| drawn[*i] += sd * normal());
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
