//! Shares of records, or of their windows, in a fit: what its covariance is estimated from.

use crate::dispersion::Quadratic;
use crate::evaluate::{Lanes, Normal};
use crate::linear::{Square, eliminate};
use std::ops::Range;

/// Records from which on they are the clusters; with fewer, their windows are.
const FEWEST_RECORDS: usize = 15;

/// Gradient of the cost of a record, or of one of its windows, in the entries of theta that it knows, nuisances eliminated.
#[derive(Clone, Debug)]
pub(crate) struct Cluster {
    /// Entries of theta.
    places: Vec<usize>,
    gradient: Vec<f64>,
    /// Curvature of the cost in them.
    curvature: Square,
    /// By how much the derivative of the weights lowers the curvature: `softening u u'`, summed over windows.
    softened: Square,
}

impl Cluster {
    fn of(lanes: &Lanes, normal: &Normal) -> Self {
        let (curvature, gradient, _) = eliminate(&normal.h, &normal.g, lanes.common());
        let mut softened = Square::zero(gradient.len());
        for (i, u) in gradient.iter().enumerate() {
            for (j, v) in gradient.iter().enumerate() {
                *softened.at_mut(i, j) = normal.softening * u * v;
            }
        }
        Self { places: lanes.theta.clone(), gradient, curvature, softened }
    }

    /// Adds another window of the same record, which knows the same entries.
    fn add(&mut self, other: &Self) {
        let sum = |to: &mut [f64], from: &[f64]| to.iter_mut().zip(from).for_each(|(a, b)| *a += b);
        sum(&mut self.gradient, &other.gradient);
        sum(&mut self.curvature.a, &other.curvature.a);
        sum(&mut self.softened.a, &other.softened.a);
    }

    /// The gradient with an entry for each of the `p` entries of theta.
    pub fn gradient(&self, p: usize) -> Vec<f64> {
        let mut u = vec![0.0; p];
        self.places.iter().zip(&self.gradient).for_each(|(&i, g)| u[i] += g);
        u
    }

    /// Curvature and gradient with an entry for each of the `p` entries of theta.
    pub fn quadratic(&self, p: usize) -> Quadratic {
        let mut s = Square::zero(p);
        for (a, &i) in self.places.iter().enumerate() {
            for (b, &j) in self.places.iter().enumerate() {
                *s.at_mut(i, j) += self.curvature.at(a, b);
            }
        }
        (s, self.gradient(p))
    }

    /// Takes the derivative of the weights out of the curvature of all clusters.
    pub fn soften(&self, bread: &mut Square) {
        for (a, &i) in self.places.iter().enumerate() {
            for (b, &j) in self.places.iter().enumerate() {
                *bread.at_mut(i, j) -= self.softened.at(a, b);
            }
        }
    }
}

/// The clusters of a fit whose windows are `records`, record by record.
pub(crate) fn clusters(records: &[Range<usize>], lanes: &[Lanes], normals: &[Normal]) -> Vec<Cluster> {
    let windows: Vec<Cluster> = lanes.iter().zip(normals).map(|(l, n)| Cluster::of(l, n)).collect();
    let together = |range: Range<usize>| {
        let (first, rest) = windows.get(range)?.split_first()?;
        let mut sum = first.clone();
        rest.iter().for_each(|window| sum.add(window));
        Some(sum)
    };
    ranges(records).into_iter().filter_map(together).collect()
}

/// Which windows make one cluster: those of a record, or each by itself where there are few records.
pub(crate) fn ranges(records: &[Range<usize>]) -> Vec<Range<usize>> {
    if records.len() < FEWEST_RECORDS {
        let windows = records.iter().cloned().flatten();
        return windows.map(|w| w..w + 1).collect();
    }
    records.to_vec()
}
