//! Least squares with difference quotients: Levenberg and Marquardt's method (Levenberg 1944, Marquardt 1963), in which blocks of
//! residuals far beyond the others are weighted down by Huber's rule.

use augsim_linear::{Mat, solve_positive_definite};

/// Residuals that belong together, such as those of a push.
pub(crate) type Block = Vec<f64>;

/// Huber's threshold, in medians of the blocks' root mean square residuals at the beginning.
const HUBER: f64 = 2.0;
/// Share of the cost that a last step gains.
const SETTLED: f64 = 1e-9;
/// Damping at the beginning, at least and at most, in units of the normal matrix's diagonal.
const DAMPING: [f64; 3] = [1e-3, 1e-9, 1e6];

/// How a fit goes down.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Descent {
    /// Step of the difference quotients.
    pub nudge: f64,
    /// Largest change of an unknown in one step.
    pub reach: f64,
    /// Steps at most.
    pub iterations: usize,
}

/// Where a fit ended.
#[derive(Debug, Clone)]
pub(crate) struct Found {
    /// The unknowns.
    pub values: Vec<f64>,
    /// Mean over the blocks of Huber's loss of their root mean square residual.
    pub loss: f64,
    /// The last linearisation.
    pub normal: Normal,
}

/// The weighted normal equations.
#[derive(Debug, Clone)]
pub(crate) struct Normal {
    matrix: Mat<f64>,
    /// Gradient of each block's loss, `[block][unknown]`.
    pub gradients: Vec<Vec<f64>>,
}

impl Descent {
    /// The least loss of the blocks of residuals that `at` gives, from `start` downhill.
    pub fn run(&self, start: Vec<f64>, at: &dyn Fn(&[f64]) -> Vec<Block>) -> Found {
        let mut values = start;
        let mut now = at(&values);
        let mut errors: Vec<f64> = now.iter().map(|r| rms(r)).collect();
        errors.sort_unstable_by(f64::total_cmp);
        let limit = HUBER * errors.get(errors.len() / 2).copied().unwrap_or(0.0).max(1e-9);
        let loss = |blocks: &[Block]| -> f64 {
            let one = |e: f64| if e <= limit { 0.5 * e * e } else { limit * (e - 0.5 * limit) };
            blocks.iter().map(|r| one(rms(r))).sum::<f64>() / blocks.len().max(1) as f64
        };
        let mut best = loss(&now);
        let mut damping = DAMPING[0];
        let mut normal = Normal::new(&now, &self.slopes(&values, &now, at), limit);
        for _ in 0..self.iterations {
            let Some(step) = normal.step(damping) else { break };
            let moved: Vec<f64> =
                values.iter().zip(&step).map(|(v, s)| v - s.clamp(-self.reach, self.reach)).collect();
            let next = at(&moved);
            let new = loss(&next);
            if new < best {
                let settled = best - new < SETTLED * best;
                (values, now, best) = (moved, next, new);
                damping = (damping * 0.2).max(DAMPING[1]);
                if settled {
                    break;
                }
                normal = Normal::new(&now, &self.slopes(&values, &now, at), limit);
            } else {
                damping *= 10.0;
                if damping > DAMPING[2] {
                    break;
                }
            }
        }
        Found { values, loss: best, normal }
    }

    /// Derivatives of all residuals by each unknown, `[unknown][block]`.
    fn slopes(&self, values: &[f64], now: &[Block], at: &dyn Fn(&[f64]) -> Vec<Block>) -> Vec<Vec<Block>> {
        let along = |k: usize| {
            let mut moved = values.to_vec();
            moved[k] += self.nudge;
            let difference =
                |(a, b): (&Block, &Block)| a.iter().zip(b).map(|(a, b)| (a - b) / self.nudge).collect();
            at(&moved).iter().zip(now).map(difference).collect()
        };
        (0..values.len()).map(along).collect()
    }
}

impl Normal {
    fn new(now: &[Block], slopes: &[Vec<Block>], limit: f64) -> Self {
        let n = slopes.len();
        let mut matrix = Mat::zeros(n, n);
        let mut gradients = Vec::with_capacity(now.len());
        for (i, r) in now.iter().enumerate() {
            let weight = (limit / rms(r)).min(1.0) / r.len() as f64;
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() * weight;
            gradients.push(slopes.iter().map(|s| dot(&s[i], r)).collect());
            for a in 0..n {
                for b in 0..n {
                    matrix[(a, b)] += dot(&slopes[a][i], &slopes[b][i]);
                }
            }
        }
        Normal { matrix, gradients }
    }

    fn step(&self, damping: f64) -> Option<Vec<f64>> {
        let n = self.matrix.nrows();
        let damped =
            Mat::from_fn(n, n, |a, b| self.matrix[(a, b)] * if a == b { 1.0 + damping } else { 1.0 });
        let gradient = Mat::from_fn(n, 1, |a, _| self.gradients.iter().map(|g: &Vec<f64>| g[a]).sum::<f64>());
        let step = solve_positive_definite(&damped, &gradient)?;
        let step: Vec<f64> = (0..n).map(|a| step[(a, 0)]).collect();
        step.iter().all(|s| s.is_finite()).then_some(step)
    }

    /// Inverse of the normal matrix, by rows; none where some unknown has no effect.
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
    //! Contract: the unknowns that made the residuals are found from afar, and a block that is far off does not pull them.
    use super::*;

    /// Decays `a exp(-k t)` less those of a = 2, k = 0.7, in blocks of five samples.
    fn residuals(p: &[f64]) -> Vec<Block> {
        let at = |t: f64| p[0] * (-p[1] * t).exp() - 2.0 * (-0.7 * t).exp();
        (0..8).map(|b| (0..5).map(|i| at(0.1 * f64::from(5 * b + i))).collect()).collect()
    }

    #[test]
    fn a_decay_is_found() {
        let descent = Descent { nudge: 1e-6, reach: 1.0, iterations: 50 };
        let found = descent.run(vec![0.5, 3.0], &residuals);
        assert!((found.values[0] - 2.0).abs() < 1e-6 && (found.values[1] - 0.7).abs() < 1e-6, "{found:?}");
        assert!(found.loss < 1e-12);
        assert!(found.normal.inverse().is_some());
    }

    #[test]
    fn a_block_far_off_pulls_little() {
        let knocked = |p: &[f64]| {
            let mut blocks = residuals(p);
            // Noise, without which the threshold would be that of exact data.
            blocks
                .iter_mut()
                .enumerate()
                .for_each(|(i, b)| b[i % 5] += if i % 2 == 0 { 1e-2 } else { -1e-2 });
            blocks[3].iter_mut().for_each(|r| *r += 5.0);
            blocks
        };
        let descent = Descent { nudge: 1e-6, reach: 1.0, iterations: 80 };
        let found = descent.run(vec![1.9, 0.75], &knocked);
        // Its weight is that of a hundredth of its error; plain least squares would be off by more than 1.
        assert!((found.values[0] - 2.0).abs() < 0.1 && (found.values[1] - 0.7).abs() < 0.1, "{found:?}");
    }
}
