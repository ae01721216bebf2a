//! Instrumental variables: estimates that noise in the regressor does not bias.
//!
//! Noise of the positions enters the regressor X, and least squares then underestimates. Instruments Z are the same rows,
//! computed from a motion without this noise: that of a simulation with the estimated parameters and the same commands
//! (IDIM-IV; Janot, Vandanjon and Gautier, "A generic instrumental variable approach for industrial robot identification", IEEE
//! T-CST 2014), the commanded motion, or the mean of the other periods of a periodic motion. With the weights W of the joints,
//!
//! ```text
//! values = (Z^T W X)^-1 Z^T W y
//! ```

use super::{LeastSquaresError, LinearEstimate};
use crate::base_parameters::{BaseParameters, ROUNDING};

/// Products of instruments, regressor and torques of one joint.
#[derive(Debug, Clone, PartialEq)]
pub struct InstrumentProducts {
    parameters: usize,
    /// Z^T X, `[parameters][parameters]`, row by row.
    regressor: Vec<f64>,
    /// Z^T Z, `[parameters][parameters]`, row by row.
    instruments: Vec<f64>,
    /// Z^T y, `[parameters]`.
    torque: Vec<f64>,
}

impl InstrumentProducts {
    /// No equations yet, for this number of parameters.
    pub fn new(parameters: usize) -> InstrumentProducts {
        let square = vec![0.0; parameters * parameters];
        InstrumentProducts {
            parameters,
            regressor: square.clone(),
            instruments: square,
            torque: vec![0.0; parameters],
        }
    }

    /// Adds an equation: rows of instruments and regressor, `[parameters]` each, and the torque.
    pub fn add(&mut self, instruments: &[f64], row: &[f64], torque: f64) {
        for (i, z) in instruments.iter().enumerate().take(self.parameters) {
            for k in 0..self.parameters {
                self.regressor[i * self.parameters + k] += z * row[k];
                self.instruments[i * self.parameters + k] += z * instruments[k];
            }
            self.torque[i] += z * torque;
        }
    }
}

/// Estimates the base parameters by instrumental variables.
///
/// `residual_sd` are the standard deviations of the joints' residuals, as of
/// [`weighted_least_squares`](super::weighted_least_squares). Where the two estimates differ by more than their standard
/// deviations, noise in the positions biases least squares, and a narrower filter is needed.
///
/// # Errors
/// A base parameter that the instruments do not determine.
pub fn instrumental_variables(
    joints: &[InstrumentProducts],
    base: &BaseParameters,
    residual_sd: &[f64],
) -> Result<LinearEstimate, LeastSquaresError> {
    let n = base.independent.len();
    let sum = |entry: &dyn Fn(&InstrumentProducts) -> f64| -> f64 {
        joints.iter().zip(residual_sd).map(|(joint, sd)| entry(joint) / (sd * sd)).sum()
    };
    let index = |joint: &InstrumentProducts, i: usize, k: usize| {
        base.independent[i] * joint.parameters + base.independent[k]
    };
    let square = |values: &dyn Fn(&InstrumentProducts, usize) -> f64| -> Vec<Vec<f64>> {
        (0..n).map(|i| (0..n).map(|k| sum(&|joint| values(joint, index(joint, i, k)))).collect()).collect()
    };
    let regressor = square(&|joint, at| joint.regressor[at]);
    let instruments = square(&|joint, at| joint.instruments[at]);
    // Columns: the torques, then the identity, which gives the inverse.
    let right = |i: usize| {
        let mut row = vec![sum(&|joint| joint.torque[base.independent[i]])];
        row.extend((0..n).map(|k| if i == k { 1.0 } else { 0.0 }));
        row
    };
    let solved = solve(regressor, (0..n).map(right).collect())
        .map_err(|k| LeastSquaresError::Singular { combination: base.combination_text(k) })?;
    let inverse = |i: usize, k: usize| solved[i][k + 1];
    // The errors have the covariance (Z^T W X)^-1 Z^T W Z (X^T W Z)^-1, because W is the inverse of the torques' covariance.
    let covariance = |i: usize, j: usize| -> f64 {
        (0..n).map(|k| inverse(i, k) * (0..n).map(|l| instruments[k][l] * inverse(j, l)).sum::<f64>()).sum()
    };
    Ok(LinearEstimate {
        values: (0..n).map(|i| solved[i][0]).collect(),
        covariance: (0..n).map(|i| (0..n).map(|j| covariance(i, j)).collect()).collect(),
        residual_sd: residual_sd.to_vec(),
    })
}

/// Solves `matrix * x = right` by Gaussian elimination with row pivots.
///
/// Rows and columns are scaled first. The error is a column without a pivot.
fn solve(mut matrix: Vec<Vec<f64>>, mut right: Vec<Vec<f64>>) -> Result<Vec<Vec<f64>>, usize> {
    let n = matrix.len();
    // The diagonal of Z^T X is about the square of a column's length.
    let scale: Vec<f64> = (0..n).map(|k| matrix[k][k].abs().sqrt()).collect();
    if let Some(k) = scale.iter().position(|scale| *scale <= 0.0 || !scale.is_finite()) {
        return Err(k);
    }
    for i in 0..n {
        (0..n).for_each(|k| matrix[i][k] /= scale[i] * scale[k]);
        right[i].iter_mut().for_each(|value| *value /= scale[i]);
    }
    for k in 0..n {
        let pivot = (k..n).max_by(|a, b| matrix[*a][k].abs().total_cmp(&matrix[*b][k].abs())).unwrap_or(k);
        // Products square the condition number, so that rounding is the square of that of the columns.
        if matrix[pivot][k].abs() <= ROUNDING * ROUNDING {
            return Err(k);
        }
        matrix.swap(k, pivot);
        right.swap(k, pivot);
        for i in k + 1..n {
            let factor = matrix[i][k] / matrix[k][k];
            let (upper, lower) = matrix.split_at_mut(i);
            lower[0].iter_mut().zip(&upper[k]).for_each(|(value, pivot)| *value -= factor * pivot);
            let (upper, lower) = right.split_at_mut(i);
            lower[0].iter_mut().zip(&upper[k]).for_each(|(value, pivot)| *value -= factor * pivot);
        }
    }
    for k in (0..n).rev() {
        for column in 0..right[k].len() {
            let known: f64 = (k + 1..n).map(|j| matrix[k][j] * right[j][column]).sum();
            right[k][column] = (right[k][column] - known) / matrix[k][k];
        }
    }
    for (row, scale) in right.iter_mut().zip(&scale) {
        row.iter_mut().for_each(|value| *value /= scale);
    }
    Ok(right)
}
