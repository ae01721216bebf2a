//! Baseline of the filter: fits PyBullet's ball to the observed rows by least squares. A point forecast.
//!
//! The objective is piecewise smooth, because a rebound happens at a whole step of the engine. The fit
//! therefore runs Levenberg-Marquardt steps from several initial values.

use super::Sensor;
use augsim_linear::{Mat, solve_positive_definite};
use augsim_physics::ball::bullet::BulletBall;

/// Restitutions from which a fit starts, besides the declared one.
const START_RESTITUTIONS: [f64; 5] = [0.3, 0.45, 0.6, 0.75, 0.9];
/// Dampings from which a fit starts, 1/s, besides the declared one.
/// Another damping gives another number of steps to the ground, where the objective jumps.
const START_DAMPINGS: [f64; 3] = [0.0, 0.015, 0.03];
/// Maximum number of Levenberg-Marquardt iterations from one start.
const MAX_ITERATIONS: usize = 40;
/// Steps of the central differences by the initial height (m), restitution, and damping (1/s).
const DIFFERENCE_STEPS: [f64; 3] = [1e-5, 1e-4, 1e-4];

/// Which unknowns are fitted besides the initial height.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FreeParameters {
    /// Only the initial height is fitted; the engine stays as declared.
    Height,
    /// Restitution and damping are fitted too: the engine is calibrated on the observed rows.
    Calibrated,
    /// The restitution is fitted too, for an engine whose damping is known.
    Restitution,
}

/// A ball that is dropped from rest, fitted to observed rows by least squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedDrop {
    /// The ball's engine, with its declared parameter values.
    pub ball: BulletBall,
    /// Which unknowns are fitted besides the initial height.
    pub freedom: FreeParameters,
}

impl FittedDrop {
    /// Simulates the drop fitted to the rows `[n, 2]` measured by `sensor`: heights and velocities `[time, 2]`.
    pub fn path(&self, rows: &[f64], sensor: &Sensor, time: usize) -> Vec<f64> {
        self.simulate(self.fit(rows, sensor), time)
    }

    /// Returns the engine with the values fitted to the rows `[n, 2]` measured by `sensor`.
    pub fn fitted(&self, rows: &[f64], sensor: &Sensor) -> BulletBall {
        let [_, restitution, damping] = self.fit(rows, sensor);
        BulletBall { restitution, damping, ..self.ball }
    }

    /// Finds initial height, restitution and damping with the smallest residual over several starts.
    fn fit(&self, rows: &[f64], sensor: &Sensor) -> [f64; 3] {
        let declared = [rows[0], self.ball.restitution, self.ball.damping];
        let start_values = |declared: f64, others: &[f64], is_free: bool| -> Vec<f64> {
            let others = if is_free { others } else { &[] };
            [declared].into_iter().chain(others.iter().copied()).collect()
        };
        let restitutions =
            start_values(declared[1], &START_RESTITUTIONS, self.freedom != FreeParameters::Height);
        let dampings = start_values(declared[2], &START_DAMPINGS, self.freedom == FreeParameters::Calibrated);
        let mut best: Option<(f64, [f64; 3])> = None;
        for &damping in &dampings {
            for &restitution in &restitutions {
                let candidate = self.minimise([declared[0], restitution, damping], rows, sensor);
                if best.is_none_or(|(cost, _)| candidate.0 < cost) {
                    best = Some(candidate);
                }
            }
        }
        best.map_or(declared, |(_, p)| p)
    }

    fn free_parameters(&self) -> &'static [usize] {
        match self.freedom {
            FreeParameters::Height => &[0],
            FreeParameters::Calibrated => &[0, 1, 2],
            FreeParameters::Restitution => &[0, 1],
        }
    }

    fn simulate(&self, [height, restitution, damping]: [f64; 3], time: usize) -> Vec<f64> {
        let ball = BulletBall { restitution, damping, ..self.ball };
        let [h, v] = ball.simulate_underside(height, 0.0, time);
        h.into_iter().zip(v).flat_map(|(h, v)| [h, v]).collect()
    }

    /// Residuals (simulated - measured) of the observed columns, in units of the measurement noise.
    fn residuals(&self, parameters: [f64; 3], rows: &[f64], sensor: &Sensor) -> Vec<f64> {
        let path = self.simulate(parameters, rows.len() / 2);
        let columns: Vec<(usize, f64)> = sensor.observed_columns().collect();
        let residual =
            |t: usize, (j, variance): (usize, f64)| (path[2 * t + j] - rows[2 * t + j]) / variance.sqrt();
        (0..rows.len() / 2).flat_map(|t| columns.iter().map(move |&c| residual(t, c))).collect()
    }

    /// Minimises the squared residuals from one start by Levenberg-Marquardt with central differences.
    /// Restitution and damping are kept between 0 and 1. Returns the sum of squares and the values.
    fn minimise(&self, start: [f64; 3], rows: &[f64], sensor: &Sensor) -> (f64, [f64; 3]) {
        let free_parameters = self.free_parameters();
        let clamp = |parameters: [f64; 3]| {
            [parameters[0], parameters[1].clamp(0.0, 1.0), parameters[2].clamp(0.0, 1.0)]
        };
        let sum_of_squares = |residuals: &[f64]| residuals.iter().map(|v| v * v).sum::<f64>();
        let (mut parameters, mut lambda) = (clamp(start), 1e-3);
        let mut residuals = self.residuals(parameters, rows, sensor);
        let mut cost = sum_of_squares(&residuals);
        for _ in 0..MAX_ITERATIONS {
            let columns: Vec<Vec<f64>> = free_parameters
                .iter()
                .map(|&k| {
                    let shifted_residuals = |sign: f64| {
                        let mut shifted = parameters;
                        shifted[k] += sign * DIFFERENCE_STEPS[k];
                        self.residuals(shifted, rows, sensor)
                    };
                    shifted_residuals(1.0)
                        .iter()
                        .zip(shifted_residuals(-1.0))
                        .map(|(a, b)| (a - b) / (2.0 * DIFFERENCE_STEPS[k]))
                        .collect()
                })
                .collect();
            let m = free_parameters.len();
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let gradient = Mat::from_fn(m, 1, |a, _| dot(&columns[a], &residuals));
            let normal = Mat::from_fn(m, m, |a, b| dot(&columns[a], &columns[b]));
            let mut improved = false;
            for _ in 0..8 {
                let damped = Mat::from_fn(m, m, |a, b| {
                    normal[(a, b)] + if a == b { lambda * normal[(a, a)] + 1e-9 } else { 0.0 }
                });
                let Some(step) = solve_positive_definite(&damped, &gradient) else { break };
                let mut trial = parameters;
                free_parameters.iter().enumerate().for_each(|(a, &k)| trial[k] -= step[(a, 0)]);
                let trial = clamp(trial);
                let trial_residuals = self.residuals(trial, rows, sensor);
                if sum_of_squares(&trial_residuals) < cost {
                    improved = cost - sum_of_squares(&trial_residuals) > 1e-9 * cost;
                    (parameters, cost, residuals) =
                        (trial, sum_of_squares(&trial_residuals), trial_residuals);
                    lambda = (lambda / 10.0).max(1e-12);
                    break;
                }
                lambda *= 10.0;
            }
            if !improved {
                break;
            }
        }
        (cost, parameters)
    }
}
