//! Robust nonlinear least squares by the Levenberg-Marquardt method.
//!
//! Levenberg 1944, Marquardt 1963; with a finite-difference Jacobian. Outlying blocks of residuals are
//! down-weighted by Huber's rule.
//!
//! With e_i the root mean square of block i (n_i residuals r_i with Jacobian J_i) and Huber's threshold k:
//! 1. loss = mean over i of rho(e_i), rho(e) = e^2 / 2 for e <= k, else k (e - k / 2)
//! 2. weight w_i = min(1, k / e_i) / n_i
//! 3. step d: (A + lambda diag A) d = g, with A = sum w_i J_i' J_i and g = sum w_i J_i' r_i
//! 4. if the loss falls, x := x - d (each entry clamped) and lambda := lambda / 5; else lambda := 10 lambda

use augsim_linear::{Mat, solve_positive_definite};

/// A block of residuals that share one robust weight, such as those of one push.
pub(crate) type Block = Vec<f64>;

/// Huber's threshold, as a multiple of the median over blocks of the root mean square residual at the start.
const HUBER_THRESHOLD: f64 = 2.0;
/// Relative decrease of the loss below which the fit has converged.
const MIN_RELATIVE_DECREASE: f64 = 1e-9;
/// Levenberg-Marquardt damping factor at the start, relative to the diagonal of the normal matrix.
const INITIAL_DAMPING: f64 = 1e-3;
/// Lower bound of the Levenberg-Marquardt damping factor.
const MIN_DAMPING: f64 = 1e-9;
/// Levenberg-Marquardt damping factor above which the fit stops.
const MAX_DAMPING: f64 = 1e6;

/// Options of a Levenberg-Marquardt fit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LevenbergMarquardt {
    /// Step of the forward differences that approximate the Jacobian, in units of the parameters.
    pub difference_step: f64,
    /// Largest change of a parameter in one iteration, in units of the parameters.
    pub max_change: f64,
    /// Maximum number of iterations of the fit.
    pub max_iterations: usize,
}

/// Result of a Levenberg-Marquardt fit.
#[derive(Debug, Clone)]
pub(crate) struct FitResult {
    /// Estimated parameter values, in the order of the start values.
    pub values: Vec<f64>,
    /// Loss at the estimate: mean over the blocks of Huber's function of the root mean square residual.
    pub loss: f64,
    /// Normal equations of the last linearisation, for confidence intervals.
    pub normal: Normal,
}

/// Robustly weighted normal equations (matrix and gradients) of a linearised fit.
#[derive(Debug, Clone)]
pub(crate) struct Normal {
    matrix: Mat<f64>,
    /// Gradient of each block's loss, `[block][parameter]`.
    pub gradients: Vec<Vec<f64>>,
}

impl LevenbergMarquardt {
    /// Minimises the robust loss of the blocks that `residuals` returns, from the values `start`.
    pub fn run(&self, start: Vec<f64>, residuals: &dyn Fn(&[f64]) -> Vec<Block>) -> FitResult {
        let mut values = start;
        let mut blocks = residuals(&values);
        let mut errors: Vec<f64> = blocks.iter().map(|r| rms(r)).collect();
        errors.sort_unstable_by(f64::total_cmp);
        let threshold = HUBER_THRESHOLD * errors.get(errors.len() / 2).copied().unwrap_or(0.0).max(1e-9);
        let loss = |blocks: &[Block]| -> f64 {
            let huber = |e: f64| if e <= threshold { 0.5 * e * e } else { threshold * (e - 0.5 * threshold) };
            blocks.iter().map(|r| huber(rms(r))).sum::<f64>() / blocks.len().max(1) as f64
        };
        let mut best = loss(&blocks);
        let mut damping = INITIAL_DAMPING;
        let mut normal = Normal::new(&blocks, &self.jacobian(&values, &blocks, residuals), threshold);
        for _ in 0..self.max_iterations {
            let Some(step) = normal.step(damping) else { break };
            let moved: Vec<f64> = values
                .iter()
                .zip(&step)
                .map(|(v, s)| v - s.clamp(-self.max_change, self.max_change))
                .collect();
            let moved_blocks = residuals(&moved);
            let moved_loss = loss(&moved_blocks);
            if moved_loss < best {
                let has_converged = best - moved_loss < MIN_RELATIVE_DECREASE * best;
                (values, blocks, best) = (moved, moved_blocks, moved_loss);
                damping = (damping * 0.2).max(MIN_DAMPING);
                if has_converged {
                    break;
                }
                normal = Normal::new(&blocks, &self.jacobian(&values, &blocks, residuals), threshold);
            } else {
                damping *= 10.0;
                if damping > MAX_DAMPING {
                    break;
                }
            }
        }
        FitResult { values, loss: best, normal }
    }

    /// Derivatives of all residuals by each parameter, `[parameter][block]`, by forward differences.
    fn jacobian(
        &self,
        values: &[f64],
        blocks: &[Block],
        residuals: &dyn Fn(&[f64]) -> Vec<Block>,
    ) -> Vec<Vec<Block>> {
        let column = |k: usize| {
            let mut moved = values.to_vec();
            moved[k] += self.difference_step;
            let difference = |(a, b): (&Block, &Block)| {
                a.iter().zip(b).map(|(a, b)| (a - b) / self.difference_step).collect()
            };
            residuals(&moved).iter().zip(blocks).map(difference).collect()
        };
        (0..values.len()).map(column).collect()
    }
}

impl Normal {
    /// Sums the normal equations over the blocks, for the Jacobian `[parameter][block]`.
    fn new(blocks: &[Block], jacobian: &[Vec<Block>], threshold: f64) -> Self {
        let n = jacobian.len();
        let mut matrix = Mat::zeros(n, n);
        let mut gradients = Vec::with_capacity(blocks.len());
        for (i, r) in blocks.iter().enumerate() {
            let weight = (threshold / rms(r)).min(1.0) / r.len() as f64;
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() * weight;
            gradients.push(jacobian.iter().map(|s| dot(&s[i], r)).collect());
            for a in 0..n {
                for b in 0..n {
                    matrix[(a, b)] += dot(&jacobian[a][i], &jacobian[b][i]);
                }
            }
        }
        Normal { matrix, gradients }
    }

    /// Solves the damped normal equations; `None` if they are singular.
    fn step(&self, damping: f64) -> Option<Vec<f64>> {
        let n = self.matrix.nrows();
        let damped =
            Mat::from_fn(n, n, |a, b| self.matrix[(a, b)] * if a == b { 1.0 + damping } else { 1.0 });
        let gradient = Mat::from_fn(n, 1, |a, _| self.gradients.iter().map(|g: &Vec<f64>| g[a]).sum::<f64>());
        let step = solve_positive_definite(&damped, &gradient)?;
        let step: Vec<f64> = (0..n).map(|a| step[(a, 0)]).collect();
        step.iter().all(|s| s.is_finite()).then_some(step)
    }

    /// Inverse of the normal matrix, by rows; `None` if a parameter has no effect on the residuals.
    pub fn inverse(&self) -> Option<Vec<Vec<f64>>> {
        let n = self.matrix.nrows();
        let inverse = solve_positive_definite(&self.matrix, &Mat::<f64>::identity(n, n))?;
        Some((0..n).map(|a| (0..n).map(|b| inverse[(a, b)]).collect()).collect())
    }
}

fn rms(r: &[f64]) -> f64 {
    (r.iter().map(|v| v * v).sum::<f64>() / r.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    //! Contract: the fit finds the generating parameters, and an outlying block hardly shifts them.
    use super::*;

    /// Residuals of `a exp(-k t)` against a = 2, k = 0.7, in blocks of five samples.
    fn residuals(p: &[f64]) -> Vec<Block> {
        let residual = |t: f64| p[0] * (-p[1] * t).exp() - 2.0 * (-0.7 * t).exp();
        (0..8).map(|b| (0..5).map(|i| residual(0.1 * f64::from(5 * b + i))).collect()).collect()
    }

    #[test]
    fn an_exponential_decay_is_recovered() {
        let descent = LevenbergMarquardt { difference_step: 1e-6, max_change: 1.0, max_iterations: 50 };
        let found = descent.run(vec![0.5, 3.0], &residuals);
        assert!((found.values[0] - 2.0).abs() < 1e-6 && (found.values[1] - 0.7).abs() < 1e-6, "{found:?}");
        assert!(found.loss < 1e-12);
        assert!(found.normal.inverse().is_some());
    }

    #[test]
    fn an_outlying_block_hardly_shifts_the_estimate() {
        let with_outlier = |p: &[f64]| {
            let mut blocks = residuals(p);
            // Noise, because without it the threshold, a multiple of the median residual, would be nearly 0.
            blocks
                .iter_mut()
                .enumerate()
                .for_each(|(i, b)| b[i % 5] += if i % 2 == 0 { 1e-2 } else { -1e-2 });
            blocks[3].iter_mut().for_each(|r| *r += 5.0);
            blocks
        };
        let descent = LevenbergMarquardt { difference_step: 1e-6, max_change: 1.0, max_iterations: 80 };
        let found = descent.run(vec![1.9, 0.75], &with_outlier);
        // Huber's rule weights the outlier as if its error were a hundredth; plain least squares would be off
        // by more than 1.
        assert!((found.values[0] - 2.0).abs() < 0.1 && (found.values[1] - 0.7).abs() < 0.1, "{found:?}");
    }
}
