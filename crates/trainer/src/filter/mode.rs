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

use super::case::Case;
use augsim_linear::{Mat, solve_positive_definite};
use augsim_physics::system::{Seed, Simulated};

/// Maximum number of Levenberg-Marquardt iterations, accepted or not.
const STEPS: usize = 60;
/// Relative decrease of the cost below which the minimisation stops.
const SETTLED: f64 = 1e-9;
/// Damping beyond which the minimisation gives up: steps are then too small to lower the cost.
const MOST_DAMPING: f64 = 1e12;
/// Number of rows of the first fit; each later fit uses twice as many.
/// A rough initial velocity may lead far away over a long prefix, so fits start on a short one.
const FIRST_ROWS: usize = 8;
/// Initial values of event offsets, in standard deviations of their prior.
/// Several are tried because the cost may have several minima.
const TRIED: [f64; 5] = [0.0, -1.0, 1.0, -2.0, 2.0];

/// A minimum of the cost.
#[derive(Debug, Clone)]
pub(super) struct Mode {
    /// Values of the unknowns at the minimum.
    pub at: Vec<f64>,
    /// Cost at the minimum.
    pub cost: f64,
    /// Covariance of the unknowns `[U, U]`: the inverse of the curvature.
    pub covariance: Vec<f64>,
}

impl Mode {
    /// Returns the best minimum over all starts, or `None` if the system cannot be simulated.
    pub fn of(case: &Case<'_>) -> Option<Self> {
        let place = case.unknowns.iter().position(|u| matches!(u.seed, Seed::Offset(_)));
        let tried = if place.is_some() { &TRIED[..] } else { &TRIED[..1] };
        let mut best: Option<(f64, Vec<f64>)> = None;
        for factor in tried {
            let mut at = case.begin();
            for (u, v) in case.unknowns.iter().zip(&mut at) {
                if let (Seed::Offset(_), Some((mean, sd))) = (u.seed, u.law) {
                    *v = mean + factor * sd;
                }
            }
            let Some(found) = case.descend(at) else { continue };
            if best.as_ref().is_none_or(|(cost, _)| found.0 < *cost) {
                best = Some(found);
            }
        }
        let (cost, at) = best?;
        let (curvature, _) = case.equations(&at, case.seen())?;
        let size = at.len();
        let scale = |i: usize| curvature[(i, i)].max(f64::MIN_POSITIVE).sqrt();
        // An unidentifiable direction has no curvature; the small diagonal term keeps the matrix
        // invertible.
        let scaled = Mat::from_fn(size, size, |i, k| {
            curvature[(i, k)] / (scale(i) * scale(k)) + if i == k { 1e-9 } else { 0.0 }
        });
        let inverse = solve_positive_definite(&scaled, &Mat::<f64>::identity(size, size))?;
        let each =
            (0..size * size).map(|e| inverse[(e / size, e % size)] / (scale(e / size) * scale(e % size)));
        Some(Mode { covariance: each.collect(), at, cost })
    }

    /// Root mean square residual of each channel; the assumed noise level where nothing was measured.
    pub fn rms(&self, case: &Case<'_>) -> Vec<f64> {
        let mut out = Simulated::default();
        let (n, channels) = (case.seen(), case.sd.len());
        if !case.simulate(&self.at, n, &[], &mut out) {
            return case.sd.clone();
        }
        let of = |c: usize| {
            let residual = |k: usize| case.rows[k * channels + c] - out.value(k, c);
            let (sum, count) = (0..n)
                .map(residual)
                .filter(|r| r.is_finite())
                .fold((0.0, 0.0), |(sum, count), r| (sum + r * r, count + 1.0));
            if count > 0.0 { (sum / count).sqrt() } else { case.sd[c] }
        };
        (0..channels).map(of).collect()
    }
}

impl Case<'_> {
    /// Start values of the unknowns: prior means, or the rough initial state where there is no prior.
    fn begin(&self) -> Vec<f64> {
        let rough = |seed| if let Seed::Start(i) = seed { self.start[i] } else { 0.0 };
        self.unknowns.iter().map(|u| u.law.map_or_else(|| rough(u.seed), |(mean, _)| mean)).collect()
    }

    /// Minimises the cost over the first [`FIRST_ROWS`] rows, then over twice as many, and so on.
    fn descend(&self, at: Vec<f64>) -> Option<(f64, Vec<f64>)> {
        let n = self.seen();
        let (mut at, mut rows) = (at, n.min(FIRST_ROWS));
        loop {
            let (cost, found) = self.descend_over(at, rows)?;
            if rows == n {
                return Some((cost, found));
            }
            (at, rows) = (found, (2 * rows).min(n));
        }
    }

    fn descend_over(&self, mut at: Vec<f64>, rows: usize) -> Option<(f64, Vec<f64>)> {
        let mut out = Simulated::default();
        let mut cost = self.cost(&at, rows, &mut out);
        if !cost.is_finite() {
            return None;
        }
        let mut damping = 1e-3;
        let (mut curvature, mut gradient) = self.equations(&at, rows)?;
        for _ in 0..STEPS {
            let size = at.len();
            let scale = |i: usize| curvature[(i, i)].max(f64::MIN_POSITIVE).sqrt();
            let scaled = Mat::from_fn(size, size, |i, k| {
                curvature[(i, k)] / (scale(i) * scale(k)) + if i == k { damping + 1e-12 } else { 0.0 }
            });
            let right = Mat::from_fn(size, 1, |i, _| gradient[i] / scale(i));
            let step = solve_positive_definite(&scaled, &right)?;
            let moved: Vec<f64> = (at.iter().zip(self.unknowns).enumerate())
                .map(|(i, (v, u))| (v + step[(i, 0)] / scale(i)).clamp(u.bounds[0], u.bounds[1]))
                .collect();
            let trial = self.cost(&moved, rows, &mut out);
            if trial < cost {
                let is_settled = cost - trial <= SETTLED * cost;
                (at, cost) = (moved, trial);
                if is_settled {
                    break;
                }
                damping = (damping * 0.2).max(1e-12);
                (curvature, gradient) = self.equations(&at, rows)?;
            } else {
                damping *= 5.0;
                if damping > MOST_DAMPING {
                    break;
                }
            }
        }
        Some((cost, at))
    }

    /// Gauss-Newton curvature `[U, U]` and negative gradient `[U]` of the cost over the first `rows` rows.
    fn equations(&self, at: &[f64], rows: usize) -> Option<(Mat<f64>, Vec<f64>)> {
        let seeds: Vec<Seed> = self.unknowns.iter().map(|u| u.seed).collect();
        let mut out = Simulated::default();
        if !self.simulate(at, rows, &seeds, &mut out) {
            return None;
        }
        let (size, channels) = (at.len(), self.sd.len());
        let (mut curvature, mut gradient) = (Mat::<f64>::zeros(size, size), vec![0.0; size]);
        for k in 0..rows {
            for c in 0..channels {
                let residual = self.rows[k * channels + c] - out.value(k, c);
                let slopes = out.slopes(k, c);
                if !residual.is_finite() || slopes.iter().any(|s| !s.is_finite()) {
                    continue;
                }
                let weight = self.sd[c].powi(-2);
                for i in 0..size {
                    gradient[i] += weight * slopes[i] * residual;
                    for j in 0..=i {
                        curvature[(i, j)] += weight * slopes[i] * slopes[j];
                    }
                }
            }
        }
        for (i, unknown) in self.unknowns.iter().enumerate() {
            if let Some((mean, sd)) = unknown.law {
                curvature[(i, i)] += sd.powi(-2);
                gradient[i] += (mean - at[i]) / (sd * sd);
            }
            for j in 0..i {
                curvature[(j, i)] = curvature[(i, j)];
            }
        }
        Some((curvature, gradient))
    }
}
