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
        let mut values = vec![theta[i]; self.groups.len()];
        for &j in &others {
            values[free[j].group.unwrap_or(0)] += theta[j];
        }
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let weight = |j: usize| if j == i { 1.0 } else { 1.0 / n };
        let all = || others.iter().copied().chain([i]);
        let variance: f64 =
            all().flat_map(|a| all().map(move |b| weight(a) * weight(b) * self.covariance.at(a, b))).sum();
        let half = 1.96 * variance.max(0.0).sqrt();
        let groups = self.groups.iter().cloned().zip(values).collect();
        Estimate { value: mean, ci95: [mean - half, mean + half], unit, groups }
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
