//! A linear model with a robust cost, for tests of levels and coverage: windows of 75 residuals, smooth
//! sensitivities.
//!
//! All true parameters are 0. The smooth model error is three low harmonics in every window, with amplitudes of
//! `model_error` standard deviations of the noise: a model error that differs from window to window.

use crate::interval::Quadratic;
use crate::linear::{Square, dot};
use augsim_data::random_stream;
use rand_distr::{Distribution, StandardNormal};

const RESIDUALS: usize = 75;
/// Degrees of freedom of the t density of residuals, as in the fits of the crate.
const STUDENT_FREEDOM: f64 = 8.0;

/// Fit of the linear test model at the minimum of its cost.
pub(crate) struct ToyFit {
    pub theta: Vec<f64>,
    pub information: Square,
    pub windows: Vec<Quadratic>,
    /// Curvature and gradient of each window, with the derivative of the window's weight in the curvature.
    pub softened: Vec<Quadratic>,
}

/// Simulated data `[window][residual]`, and the sensitivities of the residuals to each parameter.
pub(crate) struct Toy {
    y: Vec<Vec<f64>>,
    columns: Vec<Vec<Vec<f64>>>,
}

impl Toy {
    /// Draws windows with noise of standard deviation 1 and a smooth model error of `model_error` standard
    /// deviations.
    pub fn draw(windows: usize, seed: u64, model_error: f64, parameters: usize) -> Self {
        let mut rng = random_stream(seed, "linear toy", 0);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let (mut y, mut columns) = (Vec::new(), Vec::new());
        for _ in 0..windows {
            let waves: Vec<(f64, f64)> = (0..3).map(|_| (model_error * normal(), normal())).collect();
            let smooth = |u: f64, scale: &[(f64, f64)]| -> f64 {
                let turn = |n: usize| std::f64::consts::PI * (n + 1) as f64 * u;
                scale.iter().enumerate().map(|(n, (a, p))| a * (turn(n) + p).sin()).sum()
            };
            let places: Vec<f64> = (0..RESIDUALS).map(|k| k as f64 / RESIDUALS as f64).collect();
            y.push(places.iter().map(|&u| smooth(u, &waves) + normal()).collect());
            let of_window: Vec<Vec<f64>> = (0..parameters)
                .map(|_| {
                    let shape = [(normal(), normal()), (normal(), normal())];
                    places.iter().map(|&u| smooth(u, &shape)).collect()
                })
                .collect();
            columns.push(of_window);
        }
        Self { y, columns }
    }

    /// Fits the first `p` parameters to all windows.
    pub fn fit(&self, p: usize) -> ToyFit {
        let mut theta = vec![0.0; p];
        loop {
            let fit = self.at(&theta);
            let mut step: Vec<f64> = (0..p).map(|i| fit.windows.iter().map(|(_, u)| u[i]).sum()).collect();
            fit.information.cholesky().solve(&mut step);
            theta.iter_mut().zip(&step).for_each(|(t, d)| *t += d);
            if step.iter().all(|d| d.abs() < 1e-9) {
                return fit;
            }
        }
    }

    /// Rows of each window at the parameters `theta`: sensitivities, residual, and the block of the row. All
    /// rows together are divided into `blocks` equal blocks.
    pub fn rows(&self, theta: &[f64], blocks: usize) -> Vec<Vec<(Vec<f64>, f64, u16)>> {
        let total = self.y.len() * RESIDUALS;
        let row = |w: usize, k: usize| {
            let x: Vec<f64> = self.columns[w].iter().map(|column| column[k]).collect();
            let residual = self.y[w][k] - dot(&x, theta);
            (x, residual, ((w * RESIDUALS + k) * blocks / total) as u16)
        };
        (0..self.y.len()).map(|w| (0..RESIDUALS).map(|k| row(w, k)).collect()).collect()
    }

    /// Information and gradients at the parameters `theta`, without a fit.
    pub fn at(&self, theta: &[f64]) -> ToyFit {
        let p = theta.len();
        let n = STUDENT_FREEDOM + RESIDUALS as f64;
        let mut information = Square::zero(p);
        let (mut windows, mut softened) = (Vec::new(), Vec::new());
        for (y, columns) in self.y.iter().zip(&self.columns) {
            let r: Vec<f64> = (0..RESIDUALS)
                .map(|k| y[k] - (0..p).map(|i| columns[i][k] * theta[i]).sum::<f64>())
                .collect();
            let q: f64 = r.iter().map(|v| v * v).sum();
            let weight = n / (STUDENT_FREEDOM + q);
            let u: Vec<f64> = (0..p).map(|i| weight * dot(&columns[i], &r)).collect();
            let (mut s, mut soft) = (Square::zero(p), Square::zero(p));
            for i in 0..p {
                for j in 0..p {
                    *s.at_mut(i, j) = weight * dot(&columns[i], &columns[j]);
                    *information.at_mut(i, j) += s.at(i, j);
                    *soft.at_mut(i, j) = s.at(i, j) - 2.0 / n * u[i] * u[j];
                }
            }
            softened.push((soft, u.clone()));
            windows.push((s, u));
        }
        ToyFit { theta: theta.to_vec(), information, windows, softened }
    }
}
