//! The numbers of a fit with their intervals.

use super::fit::{Fit, Sample};
use super::hypothesis::Free;
use crate::linear::Square;
use crate::result::Estimate;
use std::collections::BTreeMap;

/// Values, intervals and covariance of a fit.
pub(crate) struct Numbers<'a> {
    fit: &'a Fit,
    groups: &'a [String],
    ci95: Vec<[f64; 2]>,
    pub covariance: Square,
}

impl<'a> Numbers<'a> {
    pub fn of(sample: &Sample<'a>, fit: &'a Fit) -> Self {
        let (ci95, covariance) = (fit.ci95(sample), fit.covariance(sample));
        Self { fit, groups: &sample.data.groups, ci95, covariance }
    }

    /// Names of the groups of the data.
    pub fn groups(&self) -> &[String] {
        self.groups
    }

    /// Estimates by name of the free parameters of one kind (none: the declared ones); of a parameter that differs from group to
    /// group, the mean over the groups, and their values.
    pub fn estimates(&self, kind: Option<&str>) -> BTreeMap<String, Estimate> {
        let free = &self.fit.hypothesis.free;
        // The differences belong to the kind; the value that they differ from is a declared one.
        let of_kind = |f: &Free| free.iter().any(|d| d.index == f.index && d.kind == kind);
        let listed = free.iter().enumerate().filter(|(_, f)| f.group.is_none() && of_kind(f));
        listed.map(|(i, f)| (f.name.clone(), self.estimate(i))).collect()
    }

    /// The estimate at place `i` of theta, no difference.
    pub fn estimate(&self, i: usize) -> Estimate {
        let (free, theta) = (&self.fit.hypothesis.free, &self.fit.theta);
        let unit = free[i].unit.to_string();
        let others: Vec<usize> =
            (0..free.len()).filter(|&j| free[j].group.is_some() && free[j].index == free[i].index).collect();
        if others.is_empty() {
            return Estimate { value: theta[i], ci95: self.ci95[i], unit, groups: BTreeMap::new() };
        }
        let n = self.groups.len() as f64;
        let mean: Vec<(usize, f64)> = others.iter().map(|&j| (j, 1.0 / n)).chain([(i, 1.0)]).collect();
        let of_group = |group: usize| {
            let own = others.iter().filter(|&&j| free[j].group == Some(group)).map(|&j| (j, 1.0));
            self.sum(&own.chain([(i, 1.0)]).collect::<Vec<_>>(), &unit)
        };
        let groups = self.groups.iter().enumerate().map(|(g, name)| (name.clone(), of_group(g))).collect();
        Estimate { groups, ..self.sum(&mean, &unit) }
    }

    /// A weighted sum of entries of theta.
    fn sum(&self, terms: &[(usize, f64)], unit: &str) -> Estimate {
        let value: f64 = terms.iter().map(|&(i, w)| w * self.fit.theta[i]).sum();
        let of = |&(i, w): &(usize, f64)| -> f64 {
            terms.iter().map(|&(j, v)| w * v * self.covariance.at(i, j)).sum()
        };
        let half = 1.96 * terms.iter().map(of).sum::<f64>().max(0.0).sqrt();
        Estimate { value, ci95: [value - half, value + half], unit: unit.into(), groups: BTreeMap::new() }
    }

    /// Names of all fitted numbers.
    pub fn names(&self) -> Vec<String> {
        let name = |f: &Free| match (f.group, f.kind) {
            (Some(group), _) => format!("{}[{} - {}]", f.name, self.groups[group], self.groups[0]),
            (None, Some(kind)) => format!("{kind}.{}", f.name),
            (None, None) => f.name.clone(),
        };
        self.fit.hypothesis.free.iter().map(name).collect()
    }
}
