//! Gaussian likelihoods in which parameters with standard normal priors are integrated out.
//!
//! With whitened residuals z, whitened sensitivities W, coordinates u of the linearisation point and the prior
//! N(0, I) of the coordinates,
//!
//! ```text
//! (1)  min over δ of |z - W δ|² + |u + δ|²  =  z'z + u'u - g' H⁻¹ g,   g = W'z - u,   H = I + W'W
//! ```

use crate::whiten::Columns;
use augsim_linear::{Mat, PositiveInverse, invert_positive_definite};

/// Sums over the first rows of whitened columns: targets, then sensitivities.
#[derive(Debug)]
pub(crate) struct Projection {
    /// Inner product z'z of each target with itself, `[target]`.
    pub squares: Vec<f64>,
    /// Inner products W'z of the sensitivities with each target, `[target][unknown]`.
    pub gradients: Vec<Vec<f64>>,
    /// Inverse of H = I + W'W, `[unknown][unknown]`.
    pub inverse: Mat<f64>,
}

impl Projection {
    /// Sums over the first `rows` of `columns`, of which the first `targets` are targets.
    ///
    /// `None` if the sums are not finite.
    pub fn new(columns: &Columns, targets: usize, rows: usize) -> Option<Self> {
        let unknowns = columns.count - targets;
        let mut squares = vec![0.0; targets];
        let mut gradients = vec![vec![0.0; unknowns]; targets];
        let mut h = vec![0.0; unknowns * unknowns];
        for row in columns.values.chunks_exact(columns.count.max(1)).take(rows) {
            let (z, w) = row.split_at(targets);
            for ((z, square), gradient) in z.iter().zip(&mut squares).zip(&mut gradients) {
                *square += z * z;
                gradient.iter_mut().zip(w).for_each(|(g, w)| *g += w * z);
            }
            for (i, wi) in w.iter().enumerate() {
                for (to, wj) in h[i * unknowns..=i * unknowns + i].iter_mut().zip(w) {
                    *to += wi * wj;
                }
            }
        }
        let inverse = inverse_with_prior(unknowns, 1.0, |i, j| h[i * unknowns + j])?.inverse;
        squares.iter().all(|s| s.is_finite()).then_some(Self { squares, gradients, inverse })
    }

    /// Gauss-Newton step δ from the point `u` that minimises (1) for a target.
    pub fn step(&self, target: usize, u: &[f64]) -> Vec<f64> {
        let g: Vec<f64> = self.gradients[target].iter().zip(u).map(|(g, u)| g - u).collect();
        (0..u.len()).map(|i| (0..u.len()).map(|j| self.inverse[(i, j)] * g[j]).sum()).collect()
    }

    /// Minimum (1) for a target at the linearisation point `u`.
    pub fn minimum(&self, target: usize, u: &[f64]) -> f64 {
        let gain: f64 = self
            .step(target, u)
            .iter()
            .zip(self.gradients[target].iter().zip(u))
            .map(|(d, (g, u))| d * (g - u))
            .sum();
        self.squares[target] + u.iter().map(|u| u * u).sum::<f64>() - gain
    }
}

/// Inverse of `prior` I + A for n unknowns, where `information` gives the entries of A at and below the diagonal.
///
/// `None` if it is not positive definite.
pub(crate) fn inverse_with_prior(
    n: usize,
    prior: f64,
    information: impl Fn(usize, usize) -> f64,
) -> Option<PositiveInverse> {
    let lower = |i: usize, j: usize| match i.cmp(&j) {
        std::cmp::Ordering::Less => 0.0,
        std::cmp::Ordering::Equal => prior + information(i, i),
        std::cmp::Ordering::Greater => information(i, j),
    };
    invert_positive_definite(Mat::from_fn(n, n, lower))
}

#[cfg(test)]
mod tests {
    //! Contract: the minimum is that of the closed form for one unknown and two readings.
    use super::*;
    use crate::whiten::Reading;

    #[test]
    fn the_minimum_is_the_quadratic_form_of_the_marginal_covariance() {
        // Residual (3, 1), sensitivity (2, 0): covariance I + (2, 0)(2, 0)' = diag(5, 1).
        let readings = (0..2).map(|sample| Reading { sample, output: 0 }).collect();
        let columns = Columns { readings, values: vec![3.0, 2.0, 1.0, 0.0], count: 2 };
        let sums = Projection::new(&columns, 1, 2).expect("finite");
        assert!((sums.minimum(0, &[0.0]) - (9.0 / 5.0 + 1.0)).abs() < 1e-12);
        // At another linearisation point, with the residual that a linear model has there, it is the same.
        let moved = Columns { values: vec![3.0 - 2.0 * 0.7, 2.0, 1.0, 0.0], ..columns };
        let sums = Projection::new(&moved, 1, 2).expect("finite");
        assert!((sums.minimum(0, &[0.7]) - (9.0 / 5.0 + 1.0)).abs() < 1e-12);
    }
}
