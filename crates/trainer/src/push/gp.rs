//! Gaussian-process regression with input-dependent noise.
//!
//! The function f has a squared-exponential kernel with one length scale per input (ARD):
//!
//! ```text
//! (1)  k(a, b) = s^2 exp(-1/2 sum_d ((a_d - b_d) / l_d)^2).
//! ```
//!
//! A second process g models the logarithm of the noise variance. It is fitted to the squared leave-one-out
//! residuals of f ("most likely" noise, Kersting et al. 2007),
//!
//! ```text
//! (2)  e_i = w_i / C_ii,    C = (K + R)^-1,    w = C (y - mean),
//! ```
//!
//! with variances 1 / C_ii (Rasmussen and Williams 2006, section 5.4.2). The variational bound of
//! Lázaro-Gredilla and Titsias (2011), used by GP-SUM's authors, is more expensive.

use augsim_linear::{Mat, PositiveInverse, invert_positive_definite};

/// Number of optimiser steps of the first fit, and of later fits, which are warm-started from it.
const OPTIMISER_STEPS: [usize; 2] = [60, 25];
/// Number of rounds that fit the noise variance and then refit the function.
const NOISE_ROUNDS: usize = 2;
/// Minus the mean of ln chi^2_1, which is added to ln e^2 of a residual e to estimate its log variance.
const LOG_CHI_SQUARE: f64 = 1.270_36;
/// Variance added to the kernel matrix's diagonal for positive definiteness, relative to the signal variance.
const RELATIVE_JITTER: f64 = 1e-8;

/// Inputs of the data of a Gaussian process, `D` standardised numbers per datum.
pub type Inputs<const D: usize> = [[f64; D]];

/// Logarithms of a squared-exponential kernel's parameters: deviations of signal and noise, length scales.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Kernel<const D: usize> {
    signal: f64,
    noise: f64,
    lengths: [f64; D],
}

impl<const D: usize> Kernel<D> {
    fn covariance(&self, a: &[f64; D], b: &[f64; D]) -> f64 {
        let square: f64 = (0..D).map(|d| ((a[d] - b[d]) * (-self.lengths[d]).exp()).powi(2)).sum();
        (2.0 * self.signal - 0.5 * square).exp()
    }
}

/// A Gaussian process conditioned on data.
#[derive(Debug, Clone)]
struct Process<const D: usize> {
    kernel: Kernel<D>,
    inputs: Vec<[f64; D]>,
    mean: f64,
    /// Weights w = C (y - mean) of the data, C the inverse covariance matrix (formula 2).
    weights: Vec<f64>,
    /// Inverse C of the covariance matrix of the noisy data (formula 2).
    inverse: Mat<f64>,
    log_likelihood: f64,
}

impl<const D: usize> Process<D> {
    /// Conditions the process on data `y`, with noise variances `noise` in addition to the kernel's noise.
    /// `None` if the covariance matrix is not positive definite in floating point.
    fn new(kernel: Kernel<D>, inputs: &Inputs<D>, y: &[f64], mean: f64, noise: &[f64]) -> Option<Self> {
        let n = inputs.len();
        let own_variance = (2.0 * kernel.noise).exp() + RELATIVE_JITTER * (2.0 * kernel.signal).exp();
        let matrix = Mat::from_fn(n, n, |i, j| {
            let k = if i >= j { kernel.covariance(&inputs[i], &inputs[j]) } else { 0.0 };
            if i == j { k + own_variance + noise[i] } else { k }
        });
        let PositiveInverse { inverse, half_log_determinant } = invert_positive_definite(matrix)?;
        let residuals: Vec<f64> = y.iter().map(|v| v - mean).collect();
        let weights: Vec<f64> =
            (0..n).map(|i| (0..n).map(|j| inverse[(i, j)] * residuals[j]).sum()).collect();
        let fit: f64 = weights.iter().zip(&residuals).map(|(w, r)| w * r).sum();
        let log_likelihood = -0.5 * fit - half_log_determinant;
        log_likelihood.is_finite().then_some(Process {
            kernel,
            inputs: inputs.to_vec(),
            mean,
            weights,
            inverse,
            log_likelihood,
        })
    }

    /// Gradient of the log likelihood with respect to the kernel's log parameters.
    fn gradient(&self) -> Kernel<D> {
        let n = self.inputs.len();
        let mut g = Kernel { signal: 0.0, noise: 0.0, lengths: [0.0; D] };
        let scales = self.kernel.lengths.map(|l| (-2.0 * l).exp());
        for i in 0..n {
            for j in 0..=i {
                let twice = if i == j { 1.0 } else { 2.0 };
                let w = twice * 0.5 * (self.weights[i] * self.weights[j] - self.inverse[(i, j)]);
                let (a, b) = (&self.inputs[i], &self.inputs[j]);
                let k = self.kernel.covariance(a, b);
                g.signal += 2.0 * w * k;
                for d in 0..D {
                    g.lengths[d] += w * k * (a[d] - b[d]).powi(2) * scales[d];
                }
                if i == j {
                    g.noise += 2.0 * w * (2.0 * self.kernel.noise).exp();
                }
            }
        }
        g
    }

    /// Residual and variance of each datum when predicted from all others (formula 2).
    fn leave_one_out(&self) -> Vec<(f64, f64)> {
        let residual_and_variance =
            |(i, w): (usize, &f64)| (w / self.inverse[(i, i)], 1.0 / self.inverse[(i, i)]);
        self.weights.iter().enumerate().map(residual_and_variance).collect()
    }

    fn covariances(&self, x: &[f64; D]) -> Vec<f64> {
        self.inputs.iter().map(|a| self.kernel.covariance(a, x)).collect()
    }

    fn mean_at(&self, x: &[f64; D]) -> f64 {
        self.mean + self.covariances(x).iter().zip(&self.weights).map(|(k, w)| k * w).sum::<f64>()
    }

    /// Mean and variance of the function value (without noise) at `x`.
    fn predict_function(&self, x: &[f64; D]) -> (f64, f64) {
        let k = self.covariances(x);
        let mean = self.mean + k.iter().zip(&self.weights).map(|(k, w)| k * w).sum::<f64>();
        let n = k.len();
        let explained: f64 =
            (0..n).map(|i| k[i] * (0..n).map(|j| self.inverse[(j, i)] * k[j]).sum::<f64>()).sum();
        (mean, ((2.0 * self.kernel.signal).exp() - explained).max(0.0))
    }
}

/// Settings for maximising the likelihood of a Gaussian process.
#[derive(Debug, Clone, Copy)]
struct FitOptions {
    /// Whether the noise variance of the kernel is fitted.
    is_noise_fitted: bool,
    /// Minimum and maximum length scale of the kernel.
    lengths: [f64; 2],
    steps: usize,
}

/// Maximises the likelihood by Adam on the log parameters; returns the best process of all steps.
fn optimise<const D: usize>(
    start: Kernel<D>,
    inputs: &Inputs<D>,
    y: &[f64],
    mean: f64,
    noise: &[f64],
    options: FitOptions,
) -> Option<Process<D>> {
    let FitOptions { is_noise_fitted, lengths: [low, high], steps } = options;
    let mut best = Process::new(start, inputs, y, mean, noise)?;
    let mut current = best.clone();
    let mut moments = vec![[0.0; 2]; D + 2];
    for step in 1..=steps {
        let g = current.gradient();
        let slopes = [&[g.signal, if is_noise_fitted { g.noise } else { 0.0 }][..], &g.lengths].concat();
        let bias = [1.0 - 0.9_f64.powi(step as i32), 1.0 - 0.99_f64.powi(step as i32)];
        let mut next_kernel = current.kernel;
        for (i, (slope, m)) in slopes.iter().zip(&mut moments).enumerate() {
            *m = [0.9 * m[0] + 0.1 * slope, 0.99 * m[1] + 0.01 * slope * slope];
            let change = 0.1 * (m[0] / bias[0]) / ((m[1] / bias[1]).sqrt() + 1e-12);
            match i {
                0 => next_kernel.signal = (next_kernel.signal + change).clamp(-6.0, 6.0),
                1 => next_kernel.noise = (next_kernel.noise + change).clamp(-7.0, 3.0),
                _ => {
                    next_kernel.lengths[i - 2] =
                        (next_kernel.lengths[i - 2] + change).clamp(low.ln(), high.ln())
                }
            }
        }
        let Some(next) = Process::new(next_kernel, inputs, y, mean, noise) else { break };
        current = next;
        if current.log_likelihood > best.log_likelihood {
            best = current.clone();
        }
    }
    Some(best)
}

/// A Gaussian-process regression with input-dependent noise.
#[derive(Debug, Clone)]
pub struct Heteroscedastic<const D: usize> {
    function: Process<D>,
    log_noise: Process<D>,
    noise_shift: f64,
}

impl<const D: usize> Heteroscedastic<D> {
    /// Fits the regression to standardised `inputs` and `y`.
    /// `None` if there are fewer than five data or their covariance is singular.
    pub fn fit(inputs: &Inputs<D>, y: &[f64]) -> Option<Self> {
        let n = y.len();
        if n < 5 {
            return None;
        }
        let none = vec![0.0; n];
        let first = FitOptions { is_noise_fitted: true, lengths: [0.05, 20.0], steps: OPTIMISER_STEPS[0] };
        let refit = FitOptions { is_noise_fitted: false, steps: OPTIMISER_STEPS[1], ..first };
        // The logarithms of squared residuals are noisy, so short length scales would overfit them.
        let smooth = FitOptions { is_noise_fitted: true, lengths: [0.7, 20.0], steps: OPTIMISER_STEPS[1] };
        let start = Kernel { signal: 0.0, noise: (0.3_f64).ln(), lengths: [0.0; D] };
        let mut function = optimise(start, inputs, y, 0.0, &none, first)?;
        let mut fitted = None;
        for _ in 0..NOISE_ROUNDS {
            let logs: Vec<f64> = (function.leave_one_out().iter())
                .map(|(e, _)| (e * e).max(1e-12).ln() + LOG_CHI_SQUARE)
                .collect();
            let mean = logs.iter().sum::<f64>() / n as f64;
            // The logarithm of chi^2_1 has a standard deviation of 2.2.
            let start = Kernel { signal: 0.0, noise: 2.2_f64.ln(), lengths: [0.5; D] };
            let log_noise = optimise(start, inputs, &logs, mean, &none, smooth)?;
            let noise: Vec<f64> = inputs.iter().map(|x| log_noise.mean_at(x).exp()).collect();
            let start = Kernel { noise: -7.0, ..function.kernel };
            function = optimise(start, inputs, y, 0.0, &noise, refit)?;
            // Calibrates the noise level: squared leave-one-out residuals must match their predicted
            // variance.
            let ratios = function.leave_one_out().iter().map(|(e, v)| e * e / v).sum::<f64>() / n as f64;
            fitted = Some((log_noise, ratios.max(1e-6).ln()));
        }
        let (log_noise, noise_shift) = fitted?;
        Some(Heteroscedastic { function, log_noise, noise_shift })
    }

    /// Predicts mean and variance of a new datum at `x`, noise included.
    pub fn predict(&self, x: &[f64; D]) -> (f64, f64) {
        let (mean, variance) = self.function.predict_function(x);
        (mean, variance + (self.log_noise.mean_at(x) + self.noise_shift).exp())
    }
}

/// A Gaussian-process regression with constant noise, in standard units.
#[derive(Debug, Clone)]
pub struct Homoscedastic<const D: usize>(Process<D>);

impl<const D: usize> Homoscedastic<D> {
    /// Fits the regression to standardised `inputs` and `y`.
    /// `None` if there are fewer than five data or their covariance is singular.
    pub fn fit(inputs: &Inputs<D>, y: &[f64]) -> Option<Self> {
        if y.len() < 5 {
            return None;
        }
        let options = FitOptions { is_noise_fitted: true, lengths: [0.05, 20.0], steps: OPTIMISER_STEPS[0] };
        let start = Kernel { signal: 0.0, noise: (0.3_f64).ln(), lengths: [0.0; D] };
        optimise(start, inputs, y, 0.0, &vec![0.0; y.len()], options).map(Homoscedastic)
    }

    /// Logarithms of the kernel's parameters: standard deviations of signal and noise, length scales.
    pub fn logarithms(&self) -> Vec<f64> {
        let k = &self.0.kernel;
        [&[k.signal, k.noise][..], &k.lengths].concat()
    }

    /// Rebuilds the process from its kernel parameters ([`logarithms`](Self::logarithms)) and data.
    /// `None` if the covariance matrix is singular.
    pub fn restore(logarithms: &[f64], inputs: &Inputs<D>, y: &[f64]) -> Option<Self> {
        let [signal, noise, lengths @ ..] = logarithms else { return None };
        let kernel = Kernel { signal: *signal, noise: *noise, lengths: lengths.try_into().ok()? };
        Process::new(kernel, inputs, y, 0.0, &vec![0.0; y.len()]).map(Homoscedastic)
    }

    /// Predicts the mean at `x`.
    pub fn mean(&self, x: &[f64; D]) -> f64 {
        self.0.mean_at(x)
    }

    /// Predicts the variance of a new datum at `x`, noise included.
    pub fn variance(&self, x: &[f64; D]) -> f64 {
        self.0.predict_function(x).1 + (2.0 * self.0.kernel.noise).exp()
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the gradient is that of the likelihood, and noise that grows with the input is recovered.
    use super::*;
    use augsim_data::random_stream;
    use rand_distr::{Distribution, StandardNormal};

    fn data(n: usize) -> (Vec<[f64; 1]>, Vec<f64>) {
        let mut rng = random_stream(5, "gp", 0);
        let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
        let x: Vec<[f64; 1]> = (0..n).map(|i| [4.0 * i as f64 / n as f64 - 2.0]).collect();
        let y = x.iter().map(|[x]| (2.0 * x).sin() + (0.05 + 0.1 * (x + 2.0)) * draw()).collect();
        (x, y)
    }

    #[test]
    fn gradient_agrees_with_central_differences() {
        let (x, y) = data(30);
        let no_noise = vec![0.0; 30];
        let kernel = Kernel { signal: 0.1, noise: -1.0, lengths: [-0.3] };
        let value = |k: Kernel<1>| Process::new(k, &x, &y, 0.0, &no_noise).expect("definite").log_likelihood;
        let g = Process::new(kernel, &x, &y, 0.0, &no_noise).expect("definite").gradient();
        let h = 1e-5;
        let slopes = [
            (
                value(Kernel { signal: 0.1 + h, ..kernel }) - value(Kernel { signal: 0.1 - h, ..kernel }),
                g.signal,
            ),
            (
                value(Kernel { noise: -1.0 + h, ..kernel }) - value(Kernel { noise: -1.0 - h, ..kernel }),
                g.noise,
            ),
            (
                value(Kernel { lengths: [-0.3 + h], ..kernel })
                    - value(Kernel { lengths: [-0.3 - h], ..kernel }),
                g.lengths[0],
            ),
        ];
        for (difference, slope) in slopes {
            // Truncation of order h^2 and cancellation of order 1e-16 / h, on values of order 10.
            assert!((difference / (2.0 * h) - slope).abs() < 1e-5 * slope.abs().max(1.0), "{slopes:?}");
        }
    }

    #[test]
    fn input_dependent_noise_is_recovered() {
        let (x, y) = data(200);
        let gp = Heteroscedastic::fit(&x, &y).expect("fits");
        for x in [-1.5, 0.0, 1.5] {
            let (mean, variance) = gp.predict(&[x]);
            let sd = 0.05 + 0.1 * (x + 2.0);
            assert!((mean - (2.0 * x).sin()).abs() < sd, "at {x}: {mean}");
            // About 50 data determine the noise at one place, to 10 % of its size, and the kernel smooths.
            assert!((0.6..1.6).contains(&(variance.sqrt() / sd)), "at {x}: {} for {sd}", variance.sqrt());
        }
    }

    #[test]
    fn too_few_data_are_refused() {
        assert!(Heteroscedastic::fit(&[[0.0]; 4], &[0.0; 4]).is_none());
    }
}
