//! An implicit step for stiff systems, with the exact derivative of the step.
//!
//! Singly diagonally implicit Runge-Kutta with two stages, order 2, L-stable (Alexander, SIAM Journal on
//! Numerical Analysis 14, 1977). With `g = 1 - 1/sqrt(2)` and step `h`:
//!
//! 1. `k1 = f(x + g h k1)`, `k2 = f(x + (1 - g) h k1 + g h k2)`
//! 2. `x+ = x + h ((1 - g) k1 + g k2)`
//!
//! Both equations of (1) are solved by Newton's method with the matrix `I - g h J`. The sensitivities follow
//! from the derivatives of (1) and (2), which need the same matrix.

use super::block::{Block, Columns, StepInputs};
use crate::system::{Column, System};

/// Coefficient g = 1 - 1/sqrt(2), which makes the two-stage Runge-Kutta method of order 2 L-stable.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
/// Maximum number of Newton iterations per Runge-Kutta stage.
const MAX_NEWTON_ITERATIONS: usize = 30;

/// Takes an implicit step of length `h` (s); returns false, with the state unchanged, if a stage does not converge.
pub(crate) fn step(
    block: &mut Block<1>,
    system: &System,
    step_inputs: &StepInputs<1>,
    (time, h): (f64, f64),
    columns: Option<&Columns>,
    fixed: &[bool],
) -> bool {
    let n = system.states();
    let begin = block.x.clone();
    let mut rates = [vec![0.0; n], vec![0.0; n]];
    let seed_count = columns.map_or(0, |c| c.seeds.len());
    let mut first_columns = vec![0.0; n * seed_count];
    for stage in 0..2 {
        let stage_time = time + if stage == 0 { GAMMA * h } else { h };
        let known: Vec<f64> = (0..n)
            .map(|i| begin[i][0] + if stage == 0 { 0.0 } else { (1.0 - GAMMA) * h * rates[0][i] })
            .collect();
        // The second stage starts its iterations from the rate of the first.
        if stage == 1 {
            rates[1] = rates[0].clone();
        }
        let rate = &mut rates[stage];
        let mut linearise_at = |block: &mut Block<1>, rate: &[f64]| {
            (0..n).for_each(|i| block.x[i][0] = known[i] + GAMMA * h * rate[i]);
            linearise(block, system, step_inputs, stage_time, fixed)
        };
        if !solve_stage(block, (&known, h), rate, &mut linearise_at) {
            block.x = begin;
            return false;
        }
        if let Some(columns) = columns {
            // The matrix at the solution, not at the last iterate, so that the derivative is exact.
            let (_, jacobian) = linearise_at(block, rate);
            let Some(factors) = Factors::new(iteration_matrix(&jacobian, h), n) else {
                block.x = begin;
                return false;
            };
            for seed in 0..seed_count {
                let before: Vec<f64> = (0..n)
                    .map(|i| {
                        let moved = if stage == 0 { 0.0 } else { first_columns[seed * n + i] };
                        block.s[seed * n + i][0] + (1.0 - GAMMA) * h * moved
                    })
                    .collect();
                let mut column_rate: Vec<f64> =
                    (0..n).map(|i| (0..n).map(|j| jacobian[i * n + j] * before[j]).sum()).collect();
                for entry in &system.rate_gradient.entries {
                    let is_direct =
                        matches!(entry.column, Column::Active(k) if columns.active[seed] == Some(k));
                    if is_direct && fixed.get(entry.row) != Some(&true) {
                        column_rate[entry.row] += block.registers[entry.register][0];
                    }
                }
                factors.solve(&mut column_rate);
                if stage == 0 {
                    first_columns[seed * n..][..n].copy_from_slice(&column_rate);
                } else {
                    for i in 0..n {
                        let first = first_columns[seed * n + i];
                        block.s[seed * n + i][0] += h * ((1.0 - GAMMA) * first + GAMMA * column_rate[i]);
                    }
                }
            }
        }
    }
    let [first, second] = &rates;
    (0..n).for_each(|i| block.x[i][0] = begin[i][0] + h * ((1.0 - GAMMA) * first[i] + GAMMA * second[i]));
    (0..n).for_each(|i| block.first_rate[i][0] = first[i]);
    true
}

/// Solves the equation of a Runge-Kutta stage for the stage's rate by Newton's method; returns whether it converged.
///
/// `known` is the part of the stage's state that does not depend on the stage's rate. The iteration also ends
/// when the change is small and no longer decreases, because rounding then prevents a smaller one.
fn solve_stage(
    block: &mut Block<1>,
    (known, h): (&[f64], f64),
    rate: &mut [f64],
    linearise_at: &mut impl FnMut(&mut Block<1>, &[f64]) -> (Vec<f64>, Vec<f64>),
) -> bool {
    let n = known.len();
    let mut last = f64::INFINITY;
    for _ in 0..MAX_NEWTON_ITERATIONS {
        let (values, jacobian) = linearise_at(block, rate);
        let Some(factors) = Factors::new(iteration_matrix(&jacobian, h), n) else { return false };
        let mut change: Vec<f64> = (0..n).map(|i| values[i] - rate[i]).collect();
        factors.solve(&mut change);
        rate.iter_mut().zip(&change).for_each(|(k, d)| *k += d);
        let size = (0..n)
            .map(|i| h * change[i].abs() / (1e-300 + known[i].abs() + h * rate[i].abs()))
            .fold(0.0, f64::max);
        if size < 1e-13 || size < 1e-9 && size >= 0.5 * last {
            return true;
        }
        last = size;
    }
    false
}

/// Computes the rates and their Jacobian with respect to the states, row by row; 0 for states that are `fixed`.
pub(crate) fn linearise(
    block: &mut Block<1>,
    system: &System,
    step_inputs: &StepInputs<1>,
    time: f64,
    fixed: &[bool],
) -> (Vec<f64>, Vec<f64>) {
    let n = system.states();
    let gradient = &system.rate_gradient;
    block.evaluate(system, &gradient.section, step_inputs, &[time]);
    let is_fixed = |i: usize| fixed.get(i) == Some(&true);
    let rate = |i: usize| block.registers[gradient.section.results[i] as usize][0];
    let values = (0..n).map(|i| if is_fixed(i) { 0.0 } else { rate(i) }).collect();
    let mut jacobian = vec![0.0; n * n];
    for entry in gradient.entries.iter().filter(|e| !is_fixed(e.row)) {
        if let Column::State(state) = entry.column {
            jacobian[entry.row * n + state] = block.registers[entry.register][0];
        }
    }
    (values, jacobian)
}

/// Builds the matrix `I - gamma h J` of the Newton iterations, row by row.
fn iteration_matrix(jacobian: &[f64], h: f64) -> Vec<f64> {
    let n = jacobian.len().isqrt();
    let identity = |i: usize| if i / n == i % n { 1.0 } else { 0.0 };
    jacobian.iter().enumerate().map(|(i, j)| identity(i) - GAMMA * h * j).collect()
}

/// LU factors of a small matrix, by Gaussian elimination with row pivoting.
///
/// Systems have a few states; the blocked factorisation of a library costs more to set up than these factors
/// take to solve.
struct Factors {
    rows: Vec<f64>,
    row_order: Vec<usize>,
    n: usize,
}

impl Factors {
    /// Factorises an `n` by `n` matrix; `None` if it is singular or not finite.
    fn new(mut rows: Vec<f64>, n: usize) -> Option<Factors> {
        let mut row_order: Vec<usize> = (0..n).collect();
        for column in 0..n {
            let largest = (column..n)
                .max_by(|a, b| rows[a * n + column].abs().total_cmp(&rows[b * n + column].abs()))?;
            let pivot = rows[largest * n + column];
            if pivot == 0.0 || !pivot.is_finite() {
                return None;
            }
            row_order.swap(column, largest);
            (0..n).for_each(|j| rows.swap(column * n + j, largest * n + j));
            for row in column + 1..n {
                let factor = rows[row * n + column] / pivot;
                rows[row * n + column] = factor;
                for j in column + 1..n {
                    rows[row * n + j] -= factor * rows[column * n + j];
                }
            }
        }
        Some(Factors { rows, row_order, n })
    }

    /// Solves the linear system in place: replaces the right-hand side by the solution.
    fn solve(&self, right: &mut [f64]) {
        let n = self.n;
        let mut x: Vec<f64> = self.row_order.iter().map(|i| right[*i]).collect();
        for i in 0..n {
            let known: f64 = (0..i).map(|j| self.rows[i * n + j] * x[j]).sum();
            x[i] -= known;
        }
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|j| self.rows[i * n + j] * x[j]).sum();
            x[i] = (x[i] - known) / self.rows[i * n + i];
        }
        right.copy_from_slice(&x);
    }
}
