//! Likelihood of a recording as a function of the parameters alone, with its initial state integrated out.
//!
//! With whitened residuals z, whitened sensitivities W to the parameters and V to the initial state, coordinates u of the
//! initial state at the linearisation point, and the prior N(0, I) of the initial state,
//!
//! ```text
//! (1)  -2 ln ∫ p(y | ξ + δ, x) p(x) dx = c - 2 b'δ + δ'A δ + ln |H| + ln |R| + n ln 2π,    H = I + V'V
//! (2)  c = z'z + u'u - h'H⁻¹h,   b = W'z - W'V H⁻¹h,   A = W'W - W'V H⁻¹V'W,   h = V'z - u
//! ```
//!
//! Exact for a model that is linear in both, else Laplace's approximation in the initial state.
//!
//! Initial states that recordings begin at without a declared distribution are constants, of which each recording has its own
//! (incidental parameters: Neyman and Scott 1948). With a broad prior, ln |H| then favours parameters by which an initial state is soon forgotten, by
//! up to a nat a recording, whatever the truth. With Jeffreys' prior of the initial state for given parameters, |H|^(1/2), that
//! determinant is gone, and the mean derivative at the true parameters is 0 where the model is linear in the initial state:
//!
//! ```text
//! (3)  -2 ln P(ξ + δ) = c - 2 b'δ + δ'A δ + ln |H_p| + ln |R|,     H_p: rows and columns of H of the states with a declared prior
//! ```

use crate::projection::inverse_with_prior;
use crate::whiten::Columns;
use augsim_linear::PositiveInverse;

/// Quadratic function (1) of the parameters.
#[derive(Clone, Debug)]
pub(crate) struct Reduced {
    /// Constant c.
    pub squares: f64,
    /// Vector b, `[parameter]`.
    pub gradient: Vec<f64>,
    /// Matrix A, `[parameter][parameter]`.
    pub information: Vec<Vec<f64>>,
    /// Half the logarithm of the determinant of H.
    pub half_log_determinant: f64,
    /// The same of H_p in (3).
    pub half_log_declared: f64,
    /// Step H⁻¹h of the initial state with fixed parameters.
    pub state_step: Vec<f64>,
    /// Decrease h'H⁻¹h of twice the negative log density by that step, nats.
    pub state_gain: f64,
    /// Change H⁻¹V'W of that step for each parameter, with the sign changed, `[state][parameter]`.
    pub state_by_parameter: Vec<Vec<f64>>,
}

impl Reduced {
    /// Sums the first `rows` of columns with residuals, sensitivities to `parameters` parameters, and to the initial
    /// state at `u`, of which the states `declared` have a declared prior.
    ///
    /// `None` if the sums are not finite.
    pub fn new(
        columns: &Columns,
        rows: usize,
        parameters: usize,
        u: &[f64],
        declared: &[usize],
    ) -> Option<Self> {
        let width = columns.count;
        // Products of all columns with each other: residuals first, then parameters, then the initial state.
        let mut products = vec![vec![0.0; width]; width];
        for row in columns.values.chunks_exact(width).take(rows) {
            for (sums, left) in products.iter_mut().zip(row) {
                sums.iter_mut().zip(row).for_each(|(sum, right)| *sum += left * right);
            }
        }
        if !products.iter().flatten().all(|p| p.is_finite()) {
            return None;
        }
        let state = |s: usize| 1 + parameters + s;
        let states = u.len();
        let h: Vec<f64> = (0..states).map(|s| products[state(s)][0] - u[s]).collect();
        let PositiveInverse { inverse, half_log_determinant } =
            inverse_with_prior(states, 1.0, |i, j| products[state(i)][state(j)])?;
        let half_log_declared = match declared.len() {
            0 => 0.0,
            count if count == states => half_log_determinant,
            count => {
                let product = |i: usize, j: usize| products[state(declared[i])][state(declared[j])];
                inverse_with_prior(count, 1.0, product)?.half_log_determinant
            }
        };
        let solved = |right: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (0..states).map(|i| (0..states).map(|j| inverse[(i, j)] * right(j)).sum()).collect()
        };
        let state_step = solved(&|s| h[s]);
        let by_parameter: Vec<Vec<f64>> =
            (0..parameters).map(|p| solved(&|s| products[state(s)][1 + p])).collect();
        let removed = |p: usize, steps: &[f64]| -> f64 {
            steps.iter().enumerate().map(|(s, step)| products[1 + p][state(s)] * step).sum()
        };
        let gain: f64 = h.iter().zip(&state_step).map(|(h, step)| h * step).sum();
        Some(Self {
            squares: products[0][0] + u.iter().map(|u| u * u).sum::<f64>() - gain,
            gradient: (0..parameters).map(|p| products[1 + p][0] - removed(p, &state_step)).collect(),
            information: (0..parameters)
                .map(|i| {
                    (0..parameters).map(|j| products[1 + i][1 + j] - removed(i, &by_parameter[j])).collect()
                })
                .collect(),
            half_log_determinant,
            half_log_declared,
            state_by_parameter: (0..states).map(|s| by_parameter.iter().map(|b| b[s]).collect()).collect(),
            state_step,
            state_gain: gain,
        })
    }
}

#[cfg(test)]
mod tests {
    //! Contract: with the initial state integrated out the quadratic is that of the marginal covariance.
    use super::*;
    use crate::whiten::Reading;

    #[test]
    fn the_quadratic_is_that_of_the_marginal_covariance() {
        // Residual (3, 1), sensitivity (1, 1) to a parameter, (2, 0) to the initial state: covariance diag(5, 1).
        let readings = (0..2).map(|sample| Reading { sample, output: 0 }).collect();
        let columns = Columns { readings, values: vec![3.0, 1.0, 2.0, 1.0, 1.0, 0.0], count: 3 };
        let at_zero = Reduced::new(&columns, 2, 1, &[0.0], &[0]).expect("finite");
        assert!((at_zero.squares - (9.0 / 5.0 + 1.0)).abs() < 1e-12);
        assert!((at_zero.gradient[0] - (3.0 / 5.0 + 1.0)).abs() < 1e-12);
        assert!((at_zero.information[0][0] - (1.0 / 5.0 + 1.0)).abs() < 1e-12);
        assert!((at_zero.half_log_determinant - 0.5 * 5.0_f64.ln()).abs() < 1e-12);
        assert_eq!(at_zero.half_log_declared, at_zero.half_log_determinant);
        // The same at another initial state, with the residual that a linear model has there.
        let moved = Columns { values: vec![3.0 - 2.0 * 0.7, 1.0, 2.0, 1.0, 1.0, 0.0], ..columns };
        let moved = Reduced::new(&moved, 2, 1, &[0.7], &[]).expect("finite");
        assert_eq!(moved.half_log_declared, 0.0);
        assert!((moved.squares - at_zero.squares).abs() < 1e-12);
        assert!((moved.gradient[0] - at_zero.gradient[0]).abs() < 1e-12);
    }

    #[test]
    fn the_determinant_of_declared_states_is_that_of_their_rows_and_columns() {
        // Sensitivities (2, 0) and (1, 3) to two states: H_p of the second is 1 + 1 + 9.
        let readings = (0..2).map(|sample| Reading { sample, output: 0 }).collect();
        let columns = Columns { readings, values: vec![3.0, 2.0, 1.0, 1.0, 0.0, 3.0], count: 3 };
        let found = Reduced::new(&columns, 2, 0, &[0.0, 0.0], &[1]).expect("finite");
        assert!((found.half_log_declared - 0.5 * 11.0_f64.ln()).abs() < 1e-12);
    }
}
