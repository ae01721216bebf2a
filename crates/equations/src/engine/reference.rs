//! The adaptive reference integrator, which fixed steps are checked against; values only.
//!
//! Method of Dormand and Prince of order 5 with an error estimate of order 4 (Journal of Computational and
//! Applied Mathematics 6, 1980), with nodes `c`, stage coefficients `a`, weights `b` (the last row of `a`)
//! and error weights `e`:
//!
//! 1. `k_i = f(t + c_i h, x + h sum_j a_ij k_j)`
//! 2. `x+ = x + h sum_i b_i k_i`, `error = h sum_i e_i k_i`

use super::block::{Block, StepInputs};
use crate::system::System;

/// Nodes `c` of the Dormand-Prince method, as shares of the step.
const NODES: [f64; 7] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
/// Stage coefficients `a` of the Dormand-Prince method, one row per stage.
const COEFFICIENTS: [&[f64]; 7] = [
    &[],
    &[0.2],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
    &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
    &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Error weights `e` of the Dormand-Prince method: weights of order 5 minus those of order 4.
const ERROR_WEIGHTS: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];

/// Advances one window by `h` (s); returns the error estimate divided by the allowed error (accurate up to 1).
///
/// The allowed error is `tolerance` times the size of the state plus 1e-3.
pub(crate) fn step(
    block: &mut Block<1>,
    system: &System,
    step_inputs: &StepInputs<1>,
    (time, h): (f64, f64),
    fixed: &[bool],
    tolerance: f64,
) -> f64 {
    let n = system.states();
    let begin: Vec<f64> = block.x.iter().map(|x| x[0]).collect();
    let mut rates: Vec<Vec<f64>> = Vec::with_capacity(7);
    for (node, weights) in NODES.iter().zip(COEFFICIENTS) {
        for i in 0..n {
            let moved: f64 = weights.iter().zip(&rates).map(|(w, k)| w * k[i]).sum();
            block.x[i][0] = begin[i] + h * moved;
        }
        block.evaluate(system, &system.rates, step_inputs, &[time + node * h]);
        let rate = |i: usize| block.registers[system.rates.results[i] as usize][0];
        rates.push((0..n).map(|i| if fixed.get(i) == Some(&true) { 0.0 } else { rate(i) }).collect());
    }
    (0..n).for_each(|i| block.first_rate[i][0] = rates[0][i]);
    // The last stage is at the end of the step, so that the block holds the new state already.
    (0..n)
        .map(|i| {
            let error: f64 = h * ERROR_WEIGHTS.iter().zip(&rates).map(|(w, k)| w * k[i]).sum::<f64>();
            let size = begin[i].abs().max(block.x[i][0].abs());
            error.abs() / (tolerance * (size + 1e-3))
        })
        .fold(0.0, |a: f64, b| if b.is_nan() { f64::INFINITY } else { a.max(b) })
}
