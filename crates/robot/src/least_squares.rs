//! Weighted least squares for parameters in which the joint torques are linear.
//!
//! The method is IDIM-LS, least squares of the inverse dynamic identification model (Gautier and Poignet, "Extended Kalman
//! filtering and weighted least squares dynamic identification of robot", Control Engineering Practice 2001): the equations of
//! a joint are divided by the standard deviation of its residuals. Here these deviations are estimated again from each solution
//! until they stay.

mod instruments;

pub use instruments::{InstrumentProducts, instrumental_variables};

use crate::base_parameters::BaseParameters;
use crate::triangular_factor::TriangularFactor;

/// Most iterations of the weights; they converge in about five.
const MAX_ITERATIONS: usize = 50;

/// Relative change of all standard deviations that ends the iterations.
const CHANGE: f64 = 1e-8;

/// Torque equations of one joint.
///
/// They are kept as the triangular factor of the regressor, with the torque as the last column.
#[derive(Debug, Clone, PartialEq)]
pub struct JointEquations {
    parameters: usize,
    factor: TriangularFactor,
}

/// Estimated base parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearEstimate {
    /// Values of the combinations of [`BaseParameters`], `[base]`.
    pub values: Vec<f64>,
    /// Covariance of the errors, `[base][base]`, for residuals that are independent.
    ///
    /// The samples of a decimated log are almost independent as far as they are noise. Residuals of a wrong model are not, and
    /// then the covariance is too small.
    pub covariance: Vec<Vec<f64>>,
    /// Standard deviation of each joint's residuals, N m or N, `[joints]`.
    pub residual_sd: Vec<f64>,
}

/// Why parameters cannot be estimated.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LeastSquaresError {
    /// There are fewer equations than parameters.
    #[error("{equations} torque equations do not determine {parameters} parameters; use a longer log")]
    TooFewEquations {
        /// Number of equations.
        equations: usize,
        /// Number of base parameters.
        parameters: usize,
    },
    /// A base parameter has no influence of its own on the torques of this log.
    #[error("this log does not determine `{combination}`; choose the base parameters from the log itself")]
    Singular {
        /// The combination, as a sum of parameters.
        combination: String,
    },
}

impl LinearEstimate {
    /// Standard deviation of each value's error, `[base]`.
    pub fn standard_deviations(&self) -> Vec<f64> {
        (0..self.values.len()).map(|k| self.covariance[k][k].sqrt()).collect()
    }
}

impl JointEquations {
    /// No equations yet, for this number of parameters.
    pub fn new(parameters: usize) -> JointEquations {
        JointEquations { parameters, factor: TriangularFactor::new(parameters + 1) }
    }

    /// Adds an equation: `row` times the parameters, `[parameters]`, is the torque.
    pub fn add(&mut self, row: &[f64], torque: f64) {
        let mut equation = row.to_vec();
        equation.push(torque);
        self.factor.add_rows(&equation);
    }

    /// Number of equations.
    pub fn count(&self) -> usize {
        self.factor.row_count()
    }

    /// Rows of the factor, restricted to the base parameters and the torque, `[k][base + 1]`.
    fn base_rows(&self, base: &BaseParameters) -> Vec<Vec<f64>> {
        let upper = self.factor.clone().upper();
        let restrict = |row: &[f64]| {
            let mut restricted = base.base_row(row);
            restricted.push(row[self.parameters]);
            restricted
        };
        upper.chunks_exact(self.parameters + 1).map(restrict).collect()
    }
}

/// Regressors of all joints in one factor, without the torques.
///
/// They are divided by the standard deviations of their residuals, as
/// [`base_parameters`](crate::base_parameters::base_parameters) needs it.
pub fn stacked_regressor(joints: &[JointEquations], residual_sd: &[f64]) -> TriangularFactor {
    let parameters = joints.first().map_or(0, |joint| joint.parameters);
    let mut stacked = TriangularFactor::new(parameters);
    for (joint, sd) in joints.iter().zip(residual_sd) {
        let upper = joint.factor.clone().upper();
        for row in upper.chunks_exact(parameters + 1) {
            stacked.add_rows(&row[..parameters].iter().map(|value| value / sd).collect::<Vec<_>>());
        }
    }
    stacked
}

/// Estimates the base parameters by least squares, with weights from the residuals of each joint.
///
/// # Errors
/// Fewer equations than parameters, or a base parameter that this log does not determine.
pub fn weighted_least_squares(
    joints: &[JointEquations],
    base: &BaseParameters,
) -> Result<LinearEstimate, LeastSquaresError> {
    let count = base.independent.len();
    let equations: usize = joints.iter().map(JointEquations::count).sum();
    if equations <= count {
        return Err(LeastSquaresError::TooFewEquations { equations, parameters: count });
    }
    let rows: Vec<Vec<Vec<f64>>> = joints.iter().map(|joint| joint.base_rows(base)).collect();
    // Each equation is charged with an equal share of the parameters.
    let freedom = 1.0 - count as f64 / equations as f64;
    let deviation = |rows: &[Vec<f64>], values: &[f64], equations: usize| {
        let residual =
            |row: &Vec<f64>| row[count] - row.iter().zip(values).map(|(x, value)| x * value).sum::<f64>();
        (rows.iter().map(|row| residual(row).powi(2)).sum::<f64>() / (equations as f64 * freedom)).sqrt()
    };
    let deviations = |values: &[f64]| -> Vec<f64> {
        let all: Vec<f64> = rows
            .iter()
            .zip(joints)
            .map(|(rows, joint)| deviation(rows, values, joint.count().max(1)))
            .collect();
        // A joint without residuals, as in exact data, would have an infinite weight.
        let least = 1e-9 * all.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        all.into_iter().map(|sd| sd.max(least)).collect()
    };
    // The torques themselves are the residuals of parameters of 0: joints of large torques begin with small weights.
    let mut residual_sd = deviations(&vec![0.0; count]);
    let mut solution = solve(&rows, &residual_sd, base)?;
    for _ in 0..MAX_ITERATIONS {
        let next = deviations(&solution.0);
        let change =
            residual_sd.iter().zip(&next).map(|(sd, next)| (next / sd - 1.0).abs()).fold(0.0, f64::max);
        residual_sd = next;
        solution = solve(&rows, &residual_sd, base)?;
        if change < CHANGE {
            break;
        }
    }
    let (values, covariance) = solution;
    Ok(LinearEstimate { values, covariance, residual_sd })
}

/// Values, `[base]`, and covariance of the least-squares solution of the rows divided by their standard deviations.
fn solve(
    rows: &[Vec<Vec<f64>>],
    residual_sd: &[f64],
    base: &BaseParameters,
) -> Result<(Vec<f64>, Vec<Vec<f64>>), LeastSquaresError> {
    let n = base.independent.len();
    let mut stacked = TriangularFactor::new(n + 1);
    for (rows, sd) in rows.iter().zip(residual_sd) {
        for row in rows {
            stacked.add_rows(&row.iter().map(|value| value / sd).collect::<Vec<_>>());
        }
    }
    let upper = stacked.upper();
    let r = |i: usize, j: usize| upper[i * (n + 1) + j];
    for k in 0..n {
        // The length of a column of R is that of the equations' column.
        let length = (0..=k).map(|i| r(i, k).powi(2)).sum::<f64>().sqrt();
        if r(k, k).abs() <= crate::base_parameters::ROUNDING * length {
            return Err(LeastSquaresError::Singular { combination: base.combination_text(k) });
        }
    }
    let back_substitute = |mut x: Vec<f64>| {
        for k in (0..n).rev() {
            x[k] = (x[k] - (k + 1..n).map(|j| r(k, j) * x[j]).sum::<f64>()) / r(k, k);
        }
        x
    };
    let values = back_substitute((0..n).map(|i| r(i, n)).collect());
    // Covariance: R^-1 R^-T.
    let inverse: Vec<Vec<f64>> =
        (0..n).map(|k| back_substitute((0..n).map(|i| if i == k { 1.0 } else { 0.0 }).collect())).collect();
    let product = |i: usize, j: usize| inverse.iter().map(|column| column[i] * column[j]).sum();
    let covariance = (0..n).map(|i| (0..n).map(|j| product(i, j)).collect()).collect();
    Ok((values, covariance))
}

#[cfg(test)]
mod tests;
