//! Standard errors of the parameters, and gauges: parameters that the data determine only in combination.
//!
//! The covariance of the parameters is σ² S⁻¹ with S of `steps.rs`. Eigenvectors of S with an eigenvalue of 0 are
//! directions in which the parameters can move without any change of the outputs. Priors of initial states are
//! part of S: what they determine is identifiable.

use crate::normal::WindowEquations;
use crate::outcome::Gauge;
use crate::steps::Fit;
use crate::windows::Problem;
use augsim_linear::{Mat, SymmetricEigen, symmetric_eigen};

/// Ratio to the largest eigenvalue of the scaled normal equations below which an eigenvalue counts as 0.
///
/// Their eigenvectors are combinations of parameters that are not identifiable from the data.
const IDENTIFIABILITY_CUTOFF: f64 = 1e-9;
/// Ratio to the largest eigenvalue of a window's scaled C_i below which an eigenvalue counts as 0.
///
/// Along its eigenvector the initial state has no effect on the outputs. The ratio is some hundred times the
/// rounding error of `f64`.
const STATE_CUTOFF: f64 = 1e-13;
/// Shift along an unidentifiable direction, in standard errors of a parameter, above which it belongs to the
/// gauge (the parameters of which only combinations are identifiable).
///
/// A shift of one standard error lowers the coverage of a 95 % interval to 83 %.
const MIN_GAUGE_SHIFT: f64 = 1.0;

/// Uncertainty of the free parameters at a fit, and the parameter directions that the data do not determine.
#[derive(Debug)]
pub(crate) struct Information {
    /// Standard error of each free parameter, from the identifiable combinations only.
    pub standard_errors: Vec<f64>,
    /// Covariance of the free parameters, from the identifiable combinations only.
    pub covariance: Vec<Vec<f64>>,
    /// Directions in which the free parameters can move without a change of the outputs.
    free_directions: Vec<Vec<f64>>,
    /// Error of each component of `free_directions`, by parameter.
    ///
    /// An error of the normal equations of the size of [`IDENTIFIABILITY_CUTOFF`] rotates these directions towards
    /// the identifiable eigenvectors, the more the smaller their eigenvalues.
    direction_errors: Vec<f64>,
}

impl Information {
    /// Computes the uncertainty of a fit whose scaled residuals have the variance `variance`.
    ///
    /// `None` without free parameters, or if the normal equations are not finite.
    pub fn of_fit(problem: &Problem<'_>, fit: &Fit, variance: f64) -> Option<Self> {
        let (p, n) = (problem.free_parameters.len(), problem.free_states.len());
        if p == 0 {
            return None;
        }
        let mut matrix = vec![0.0; p * p];
        for window in &fit.normal.windows {
            add_reduced(&mut matrix, window, (p, n))?;
        }
        let sizes: Vec<f64> = (0..p).map(|i| matrix[i * p + i].max(f64::MIN_POSITIVE).sqrt()).collect();
        let scaled = Mat::from_fn(p, p, |i, j| matrix[i * p + j] / (sizes[i] * sizes[j]));
        let SymmetricEigen { values, vectors } = symmetric_eigen(&scaled)?;
        let largest = (0..p).map(|k| values[k]).fold(0.0, f64::max);
        let is_identifiable = |k: &usize| values[*k] > IDENTIFIABILITY_CUTOFF * largest;
        let (known, unknown): (Vec<usize>, Vec<usize>) = (0..p).partition(is_identifiable);
        let covariance = |i: usize, j: usize| {
            let sum: f64 = known.iter().map(|k| vectors[(i, *k)] * vectors[(j, *k)] / values[*k]).sum();
            variance * sum / (sizes[i] * sizes[j])
        };
        let direction_error = |i: usize| {
            let turns: f64 = known.iter().map(|k| vectors[(i, *k)].abs() / values[*k]).sum();
            IDENTIFIABILITY_CUTOFF * largest * turns / sizes[i]
        };
        let direction = |k: &usize| (0..p).map(|i| vectors[(i, *k)] / sizes[i]).collect();
        Some(Self {
            standard_errors: (0..p).map(|i| covariance(i, i).sqrt()).collect(),
            covariance: (0..p).map(|i| (0..p).map(|j| covariance(i, j)).collect()).collect(),
            free_directions: unknown.iter().map(direction).collect(),
            direction_errors: (0..p).map(direction_error).collect(),
        })
    }

    /// Group of parameters that are not identifiable one by one; `None` if every parameter is identifiable.
    pub fn gauge(&self, problem: &Problem<'_>, values: &[f64]) -> Option<Gauge> {
        if self.free_directions.is_empty() {
            return None;
        }
        let declared = problem.system.parameters();
        let free = &problem.free_parameters;
        let mut takes_part = vec![false; free.len()];
        for direction in &self.free_directions {
            // The parameters can move along the gauge until one of them has doubled, vanished or met a bound.
            let room = free.iter().zip(direction).filter(|(_, d)| **d != 0.0).map(|(i, d)| {
                let (p, value) = (&declared[*i], values[*i]);
                let farthest = (p.max - value).max(value - p.min);
                let size = if value == 0.0 { farthest } else { value.abs().min(farthest) };
                size / d.abs()
            });
            let far = room.filter(|r| *r > 0.0).fold(f64::INFINITY, f64::min);
            for (i, d) in direction.iter().enumerate().filter(|(i, d)| d.abs() > self.direction_errors[*i]) {
                takes_part[i] |= far.is_finite() && d.abs() * far > MIN_GAUGE_SHIFT * self.standard_errors[i];
            }
        }
        let parameters: Vec<usize> = (0..free.len()).filter(|i| takes_part[*i]).map(|i| free[i]).collect();
        let combinations = parameters.len().saturating_sub(self.free_directions.len());
        (!parameters.is_empty()).then_some(Gauge { parameters, combinations })
    }
}

/// Adds a window's A_i - B_i C_i⁺ B_iᵀ (pseudoinverse C_i⁺) to `matrix`, `[parameter][parameter]`; `None` if
/// not finite.
///
/// A damped inverse, as in the steps of a fit, would hide combinations of parameters and initial states that
/// are not identifiable.
fn add_reduced(matrix: &mut [f64], window: &WindowEquations, (p, n): (usize, usize)) -> Option<()> {
    for i in 0..p {
        for j in 0..p {
            matrix[i * p + j] += window.a[i.max(j) * p + i.min(j)];
        }
    }
    if n == 0 {
        return Some(());
    }
    let c = |i: usize, k: usize| window.c[i.max(k) * n + i.min(k)];
    let sizes: Vec<f64> = (0..n).map(|i| c(i, i).max(f64::MIN_POSITIVE).sqrt()).collect();
    let scaled = Mat::from_fn(n, n, |i, k| c(i, k) / (sizes[i] * sizes[k]));
    let SymmetricEigen { values, vectors } = symmetric_eigen(&scaled)?;
    let largest = (0..n).map(|k| values[k]).fold(0.0, f64::max);
    for k in (0..n).filter(|k| values[*k] > STATE_CUTOFF * largest) {
        let projected: Vec<f64> = (0..p)
            .map(|i| (0..n).map(|s| window.b[i * n + s] * vectors[(s, k)] / sizes[s]).sum::<f64>())
            .collect();
        for i in 0..p {
            for j in 0..p {
                matrix[i * p + j] -= projected[i] * projected[j] / values[k];
            }
        }
    }
    Some(())
}
