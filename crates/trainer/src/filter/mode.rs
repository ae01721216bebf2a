//! Maximum a posteriori estimate of a trajectory's unknowns, by Levenberg-Marquardt iterations.
//!
//! With Jacobian J of the outputs in units of the noise, residuals r, prior means m and precisions P, a
//! step d of the unknowns u solves
//!
//! ```text
//! (1)  (J'J + P + damping D) d = J'r + P (m - u),    D = diag(J'J + P),
//! ```
//!
//! and the covariance of the estimate is (J'J + P)^-1 at the minimum.

use super::inference_problem::InferenceProblem;
use augsim_linear::{Mat, solve_positive_definite};
use augsim_system::{Seed, Simulated};

/// Maximum number of Levenberg-Marquardt iterations, accepted or not.
const MAX_ITERATIONS: usize = 60;
/// Relative decrease of the cost (negative log posterior) below which the minimisation stops.
const CONVERGED_DECREASE: f64 = 1e-9;
/// Damping factor above which the minimisation gives up: steps are then too small to lower the cost.
const MAX_DAMPING: f64 = 1e12;
/// Number of rows of the first fit; each later fit uses twice as many.
/// A rough initial velocity may lead far away over a long prefix, so fits start on a short one.
const FIRST_FIT_ROWS: usize = 8;
/// Initial values of event offsets (random deviations), in standard deviations of their prior.
/// Several are tried because the cost may have several minima.
const OFFSET_STARTS: [f64; 5] = [0.0, -1.0, 1.0, -2.0, 2.0];

/// A minimum of the cost (negative log posterior density) of a trajectory's unknowns.
#[derive(Debug, Clone)]
pub(super) struct Mode {
    /// Values of the unknowns at the minimum of the cost.
    pub values: Vec<f64>,
    /// Cost (negative log posterior density, up to a constant) at the minimum.
    pub cost: f64,
    /// Covariance `[U, U]` of the U unknowns: the inverse of the cost's curvature at the minimum.
    pub covariance: Vec<f64>,
}

impl Mode {
    /// Finds the lowest minimum of the cost over all starts; `None` if the system cannot be simulated.
    pub fn find(problem: &InferenceProblem<'_>) -> Option<Self> {
        let first_offset = problem.unknowns.iter().position(|u| matches!(u.seed, Seed::Offset(_)));
        let offset_starts = if first_offset.is_some() { &OFFSET_STARTS[..] } else { &OFFSET_STARTS[..1] };
        let mut best: Option<(f64, Vec<f64>)> = None;
        for factor in offset_starts {
            let mut values = problem.initial_values();
            for (u, v) in problem.unknowns.iter().zip(&mut values) {
                if let (Seed::Offset(_), Some((mean, sd))) = (u.seed, u.prior) {
                    *v = mean + factor * sd;
                }
            }
            let Some(minimum) = problem.minimise(values) else { continue };
            if best.as_ref().is_none_or(|(cost, _)| minimum.0 < *cost) {
                best = Some(minimum);
            }
        }
        let (cost, values) = best?;
        let (curvature, _) = problem.normal_equations(&values, problem.observed_rows())?;
        let size = values.len();
        let scale = |i: usize| curvature[(i, i)].max(f64::MIN_POSITIVE).sqrt();
        // An unidentifiable direction has no curvature; the small diagonal term keeps the matrix
        // invertible.
        let scaled = Mat::from_fn(size, size, |i, k| {
            curvature[(i, k)] / (scale(i) * scale(k)) + if i == k { 1e-9 } else { 0.0 }
        });
        let inverse = solve_positive_definite(&scaled, &Mat::<f64>::identity(size, size))?;
        let entries =
            (0..size * size).map(|e| inverse[(e / size, e % size)] / (scale(e / size) * scale(e % size)));
        Some(Mode { covariance: entries.collect(), values, cost })
    }

    /// Root mean square residual of each channel; the assumed noise level where nothing was measured.
    pub fn rmse(&self, problem: &InferenceProblem<'_>) -> Vec<f64> {
        let mut simulated = Simulated::default();
        let (rows, channels) = (problem.observed_rows(), problem.sd.len());
        if !problem.simulate(&self.values, rows, &[], &mut simulated) {
            return problem.sd.clone();
        }
        let rms_of = |c: usize| {
            let residual = |k: usize| problem.rows[k * channels + c] - simulated.value(k, c);
            let (sum, count) = (0..rows)
                .map(residual)
                .filter(|r| r.is_finite())
                .fold((0.0, 0.0), |(sum, count), r| (sum + r * r, count + 1.0));
            if count > 0.0 { (sum / count).sqrt() } else { problem.sd[c] }
        };
        (0..channels).map(rms_of).collect()
    }
}

impl InferenceProblem<'_> {
    /// Start values of the unknowns: prior means, or the rough initial state where there is no prior.
    fn initial_values(&self) -> Vec<f64> {
        let start_value = |seed| if let Seed::Start(i) = seed { self.start[i] } else { 0.0 };
        self.unknowns.iter().map(|u| u.prior.map_or_else(|| start_value(u.seed), |(mean, _)| mean)).collect()
    }

    /// Minimises the cost over the first [`FIRST_FIT_ROWS`] rows, then over twice as many, and so on.
    fn minimise(&self, start: Vec<f64>) -> Option<(f64, Vec<f64>)> {
        let n = self.observed_rows();
        let (mut values, mut rows) = (start, n.min(FIRST_FIT_ROWS));
        loop {
            let (cost, values_there) = self.minimise_over(values, rows)?;
            if rows == n {
                return Some((cost, values_there));
            }
            (values, rows) = (values_there, (2 * rows).min(n));
        }
    }

    fn minimise_over(&self, mut values: Vec<f64>, rows: usize) -> Option<(f64, Vec<f64>)> {
        let mut out = Simulated::default();
        let mut cost = self.negative_log_posterior(&values, rows, &mut out);
        if !cost.is_finite() {
            return None;
        }
        let mut damping = 1e-3;
        let (mut curvature, mut gradient) = self.normal_equations(&values, rows)?;
        for _ in 0..MAX_ITERATIONS {
            let size = values.len();
            let scale = |i: usize| curvature[(i, i)].max(f64::MIN_POSITIVE).sqrt();
            let scaled = Mat::from_fn(size, size, |i, k| {
                curvature[(i, k)] / (scale(i) * scale(k)) + if i == k { damping + 1e-12 } else { 0.0 }
            });
            let right_side = Mat::from_fn(size, 1, |i, _| gradient[i] / scale(i));
            let step = solve_positive_definite(&scaled, &right_side)?;
            let trial_values: Vec<f64> = (values.iter().zip(self.unknowns).enumerate())
                .map(|(i, (v, u))| (v + step[(i, 0)] / scale(i)).clamp(u.bounds[0], u.bounds[1]))
                .collect();
            let trial_cost = self.negative_log_posterior(&trial_values, rows, &mut out);
            if trial_cost < cost {
                let is_converged = cost - trial_cost <= CONVERGED_DECREASE * cost;
                (values, cost) = (trial_values, trial_cost);
                if is_converged {
                    break;
                }
                damping = (damping * 0.2).max(1e-12);
                (curvature, gradient) = self.normal_equations(&values, rows)?;
            } else {
                damping *= 5.0;
                if damping > MAX_DAMPING {
                    break;
                }
            }
        }
        Some((cost, values))
    }

    /// Gauss-Newton curvature `[U, U]` and negative gradient `[U]` of the cost over the first `rows` rows.
    /// `None` if the simulation fails.
    fn normal_equations(&self, values: &[f64], rows: usize) -> Option<(Mat<f64>, Vec<f64>)> {
        let seeds: Vec<Seed> = self.unknowns.iter().map(|u| u.seed).collect();
        let mut out = Simulated::default();
        if !self.simulate(values, rows, &seeds, &mut out) {
            return None;
        }
        let (size, channels) = (values.len(), self.sd.len());
        let (mut curvature, mut gradient) = (Mat::<f64>::zeros(size, size), vec![0.0; size]);
        for k in 0..rows {
            for c in 0..channels {
                let residual = self.rows[k * channels + c] - out.value(k, c);
                let derivatives = out.slopes(k, c);
                if !residual.is_finite() || derivatives.iter().any(|s| !s.is_finite()) {
                    continue;
                }
                let weight = self.sd[c].powi(-2);
                for i in 0..size {
                    gradient[i] += weight * derivatives[i] * residual;
                    for j in 0..=i {
                        curvature[(i, j)] += weight * derivatives[i] * derivatives[j];
                    }
                }
            }
        }
        for (i, unknown) in self.unknowns.iter().enumerate() {
            if let Some((mean, sd)) = unknown.prior {
                curvature[(i, i)] += sd.powi(-2);
                gradient[i] += (mean - values[i]) / (sd * sd);
            }
            for j in 0..i {
                curvature[(j, i)] = curvature[(i, j)];
            }
        }
        Some((curvature, gradient))
    }
}
