//! Forecasts of repeated trajectories that differ by a hidden quantity, by regression on past ones.
//!
//! An example is a push that is repeated over a surface with unknown friction. Deviations from the mean
//! trajectory, in units of the measurement noise, are expressed in principal components: x of the observed
//! rows and y of the remaining rows. Each y is a Gaussian process of x (Rasmussen and Williams 2006) with
//! kernel
//!
//! ```text
//! (1)  k(a, b) = a'S b / v + exp(-(a - b)'S(a - b) / (2 v l^2)),    S = diag(var_i^-w),
//! ```
//!
//! where var_i is the variance of component i, v the sum of S_ii var_i, l the length scale and w the
//! whitening exponent. A ridge is added to the diagonal. Length scale, exponent and ridge minimise the
//! squared error on validation trajectories that the process is not fitted to. The covariance of these
//! errors, less the measurement noise, is the covariance of the forecast.

use super::prefix::{FilterSettings, Prefix, PrefixForecaster, add_measurement_noise};
use crate::latent::cholesky;
use crate::{Samples, Sequences, TrainerError};
use augsim_data::random_stream;
use augsim_linear::{Mat, SymmetricEigen, gram, solve_positive_definite, symmetric_eigen};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Maximum number of principal components of the observed and of the remaining rows.
const MAX_COMPONENTS: [usize; 2] = [8, 12];
/// Minimum variance of an observed component, in variances of the measurement noise.
/// A component below it is mostly noise.
pub(super) const MIN_COMPONENT_VARIANCE: f64 = 1.2;
/// Every n-th trajectory is used for the choice of the hyperparameters only, as validation.
const VALIDATION_STRIDE: usize = 8;
/// Maximum number of trajectories with which hyperparameters are chosen: the cost grows with its cube.
const MAX_SELECTION_TRAJECTORIES: usize = 1200;
/// Candidate whitening exponents w of kernel (1): 1 gives all observed components the same variance.
const WHITENING_EXPONENTS: [f64; 3] = [0.0, 0.5, 1.0];
/// Candidate length scales l of kernel (1), in root mean square distances from the mean.
const LENGTH_SCALES: [f64; 4] = [0.5, 1.0, 2.0, 4.0];
/// Candidate ridges (variance not explained by the observed components), in the kernel's unit.
const RIDGES: [f64; 3] = [0.003, 0.03, 0.3];
/// Weight of the linear part of kernel (1).
const LINEAR_WEIGHT: f64 = 1.0;

/// Forecasts repeated trajectories by Gaussian-process regression on past ones, after prefixes of given lengths.
#[derive(Debug, Clone)]
pub struct TrajectoryRegression {
    mean: Vec<f64>,
    sd: Vec<f64>,
    conditionals: BTreeMap<usize, Conditional>,
}

/// Distribution of the remaining rows given the first rows, for one prefix length.
#[derive(Debug, Clone)]
struct Conditional {
    /// Principal directions of the n observed rows, `[k, n S]`, then those of the remaining rows, `[m, (T - n) S]`.
    observed_directions: Vec<Vec<f64>>,
    remaining_directions: Vec<Vec<f64>>,
    /// Variances of the principal components of the observed rows.
    variances: Vec<f64>,
    /// Principal component scores of the observed rows, for each training trajectory.
    training_scores: Vec<Vec<f64>>,
    /// Kernel and weights of the Gaussian process of each remaining component.
    processes: Vec<(Kernel, Vec<f64>)>,
    /// Cholesky factor of the covariance of the errors in the m remaining components, `[m, m]`.
    factor: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Kernel {
    whitening: f64,
    length: f64,
    ridge: f64,
}

impl Kernel {
    /// Returns the diagonal of S and the sum v of S_ii var_i, as in kernel (1), for components of these variances.
    fn scales(&self, variances: &[f64]) -> (Vec<f64>, f64) {
        let scales: Vec<f64> = variances.iter().map(|v| v.powf(-self.whitening)).collect();
        let size = dot(&scales, variances);
        (scales, size)
    }

    fn value(&self, a: &[f64], b: &[f64], (scales, size): (&[f64], f64)) -> f64 {
        let (mut inner, mut square) = (0.0, 0.0);
        for ((a, b), scale) in a.iter().zip(b).zip(scales) {
            inner += scale * a * b;
            square += scale * (a - b) * (a - b);
        }
        LINEAR_WEIGHT * inner / size + (-0.5 * square / (size * self.length * self.length)).exp()
    }
}

impl TrajectoryRegression {
    /// Learns the regression from trajectories of equal length; `sd` is the measurement noise of each column.
    ///
    /// # Errors
    /// [`TrainerError`] if the trajectories differ in length or are too few, or a prefix is empty or leaves no row.
    pub fn fit(train: &Sequences, sd: &[f64], lengths: &[usize]) -> Result<Self, TrainerError> {
        let time = train.items.first().map_or(0, |q| q.time);
        if let Some(other) = train.items.iter().find(|q| q.time != time) {
            return Err(TrainerError::TooShort { id: other.id.clone(), samples: other.time });
        }
        if train.items.len() < 4 * VALIDATION_STRIDE || lengths.iter().any(|n| *n == 0 || *n >= time) {
            return Err(TrainerError::NoTrajectories {
                what: "the training set (32 trajectories longer than every prefix are needed)",
            });
        }
        let (n, s) = (train.items.len() as f64, sd.len());
        let mut mean = vec![0.0; time * s];
        for q in &train.items {
            mean.iter_mut().zip(&q.states).for_each(|(m, v)| *m += v / n);
        }
        let scaled = |states: &[f64]| -> Vec<f64> {
            states.iter().zip(&mean).enumerate().map(|(i, (v, m))| (v - m) / sd[i % s]).collect()
        };
        let curves: Vec<Vec<f64>> = train.items.iter().map(|q| scaled(&q.states)).collect();
        let conditionals = lengths.iter().map(|&n| Ok((n, Conditional::fit(&curves, n * s)?)));
        let conditionals = conditionals.collect::<Result<_, TrainerError>>()?;
        Ok(TrajectoryRegression { mean, sd: sd.to_vec(), conditionals })
    }
}

/// Computes the principal directions of rows, `[component, width]`, and their variances, largest first.
/// At most `most` of them, with variances above `least`; the first is kept whatever its variance.
pub(super) fn components(rows: &[&[f64]], most: usize, least: f64) -> Option<(Vec<Vec<f64>>, Vec<f64>)> {
    let width = rows.first()?.len();
    let x = Mat::from_fn(rows.len(), width, |i, j| rows[i][j]);
    let covariance = gram(&x, 1.0 / rows.len() as f64);
    let SymmetricEigen { values, vectors } = symmetric_eigen(&covariance)?;
    let indices = (0..width).rev().take(most).filter(|&k| k + 1 == width || values[k] > least);
    Some(
        indices
            .map(|k| ((0..width).map(|j| vectors[(j, k)]).collect(), values[k].max(f64::MIN_POSITIVE)))
            .unzip(),
    )
}

/// Inner product of two vectors.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Principal component scores of a row: its inner products with the directions.
pub(super) fn scores(directions: &[Vec<f64>], row: &[f64]) -> Vec<f64> {
    directions.iter().map(|d| dot(d, row)).collect()
}

/// Fits the Gaussian-process weights of every target, `[target][trajectory]`.
/// `None` where the kernel matrix is singular.
fn process_weights(
    kernel: &Kernel,
    training_scores: &[Vec<f64>],
    variances: &[f64],
    targets: &[Vec<f64>],
) -> Option<Vec<Vec<f64>>> {
    let (n, (scales, size)) = (training_scores.len(), kernel.scales(variances));
    let k = Mat::from_fn(n, n, |i, j| {
        let ridge = if i == j { kernel.ridge } else { 0.0 };
        if i >= j {
            kernel.value(&training_scores[i], &training_scores[j], (&scales, size)) + ridge
        } else {
            0.0
        }
    });
    let right_side = Mat::from_fn(n, targets.len(), |i, t| targets[t][i]);
    let solution = solve_positive_definite(&k, &right_side)?;
    Some((0..targets.len()).map(|t| (0..n).map(|i| solution[(i, t)]).collect()).collect())
}

fn kernel_mean(
    kernel: &Kernel,
    weights: &[f64],
    training_scores: &[Vec<f64>],
    variances: &[f64],
    x: &[f64],
) -> f64 {
    let (scales, size) = kernel.scales(variances);
    training_scores.iter().zip(weights).map(|(a, w)| w * kernel.value(a, x, (&scales, size))).sum()
}

/// Squared validation error of every target under each candidate kernel, `[kernel][target]`.
/// Scores are `[trajectory][component]`, targets `[target][trajectory]`. Kernels with a singular matrix are
/// left out.
fn validation_errors(
    (training_scores, targets): (&[Vec<f64>], &[Vec<f64>]),
    (validation_scores, validation_targets): (&[Vec<f64>], &[Vec<f64>]),
    variances: &[f64],
) -> Vec<(Kernel, Vec<f64>)> {
    let training_scores = &training_scores[..training_scores.len().min(MAX_SELECTION_TRAJECTORIES)];
    let targets: Vec<Vec<f64>> = targets.iter().map(|t| t[..training_scores.len()].to_vec()).collect();
    let mut kernels = Vec::new();
    for whitening in WHITENING_EXPONENTS {
        for length in LENGTH_SCALES {
            kernels.extend(RIDGES.map(|ridge| Kernel { whitening, length, ridge }));
        }
    }
    let errors_of = |kernel: Kernel| {
        let weights = process_weights(&kernel, training_scores, variances, &targets)?;
        let error = |(w, y): (&Vec<f64>, &Vec<f64>)| {
            let pairs = validation_scores.iter().zip(y);
            pairs.map(|(x, y)| (y - kernel_mean(&kernel, w, training_scores, variances, x)).powi(2)).sum()
        };
        Some((kernel, weights.iter().zip(validation_targets).map(error).collect()))
    };
    kernels.into_par_iter().filter_map(errors_of).collect()
}

impl Conditional {
    /// Fits the distribution of the remaining values given the first `observed_values` values of `curves`.
    /// Curves are deviations from the mean trajectory in units of the measurement noise.
    fn fit(curves: &[Vec<f64>], observed_values: usize) -> Result<Self, TrainerError> {
        let refuse = || TrainerError::NoTrajectories { what: "the varying part of the training set" };
        let validation: Vec<&Vec<f64>> = curves.iter().step_by(VALIDATION_STRIDE).collect();
        let fitted: Vec<&Vec<f64>> =
            curves.iter().enumerate().filter(|(i, _)| i % VALIDATION_STRIDE != 0).map(|(_, c)| c).collect();
        let values_in =
            |range: std::ops::Range<usize>| fitted.iter().map(|c| &c[range.clone()]).collect::<Vec<_>>();
        let width = fitted.first().map_or(0, |c| c.len());
        let (observed_directions, variances) =
            components(&values_in(0..observed_values), MAX_COMPONENTS[0], MIN_COMPONENT_VARIANCE)
                .ok_or_else(refuse)?;
        let (remaining_directions, _) =
            components(&values_in(observed_values..width), MAX_COMPONENTS[1], 0.0).ok_or_else(refuse)?;
        let training_scores: Vec<Vec<f64>> =
            fitted.iter().map(|c| scores(&observed_directions, &c[..observed_values])).collect();
        let validation_scores: Vec<Vec<f64>> =
            validation.iter().map(|c| scores(&observed_directions, &c[..observed_values])).collect();
        let project = |curves: &[&Vec<f64>]| -> Vec<Vec<f64>> {
            remaining_directions
                .iter()
                .map(|d| curves.iter().map(|c| dot(d, &c[observed_values..])).collect())
                .collect()
        };
        let (targets, validation_targets) = (project(&fitted), project(&validation));
        let candidates = validation_errors(
            (&training_scores, &targets),
            (&validation_scores, &validation_targets),
            &variances,
        );
        let mut processes: Vec<(Kernel, Vec<f64>)> = Vec::new();
        for (t, target) in targets.iter().enumerate() {
            let kernel = candidates.iter().min_by(|a, b| a.1[t].total_cmp(&b.1[t])).ok_or_else(refuse)?.0;
            // Components with the same hyperparameters could share a factorisation, but there are few of
            // them.
            let final_weights =
                process_weights(&kernel, &training_scores, &variances, std::slice::from_ref(target))
                    .ok_or_else(refuse)?;
            processes.extend(final_weights.into_iter().map(|w| (kernel, w)));
        }
        let m = remaining_directions.len();
        let errors: Vec<Vec<f64>> = (validation_scores.iter().enumerate())
            .map(|(j, x)| {
                let pairs = processes.iter().zip(&validation_targets);
                pairs
                    .map(|((kernel, w), y)| y[j] - kernel_mean(kernel, w, &training_scores, &variances, x))
                    .collect()
            })
            .collect();
        let mut covariance = vec![0.0; m * m];
        for e in &errors {
            for a in 0..m {
                for b in 0..m {
                    covariance[a * m + b] += e[a] * e[b] / errors.len() as f64;
                }
            }
        }
        // Directions are orthonormal and curves are in units of the noise, so the noise adds 1 to each
        // variance.
        (0..m).for_each(|a| covariance[a * m + a] = (covariance[a * m + a] - 1.0).max(0.0));
        Ok(Conditional {
            observed_directions,
            remaining_directions,
            variances,
            training_scores,
            processes,
            factor: cholesky(&covariance, m),
        })
    }
}

impl PrefixForecaster for TrajectoryRegression {
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        settings: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        let s = self.sd.len();
        let forecast_after = |&n: &usize| {
            let Some(conditional) = self.conditionals.get(&n).filter(|_| prefix.time * s == self.mean.len())
            else {
                let rule = "the model was not fitted to this number of rows; fit it again with this length";
                return Err(TrainerError::Setting { key: "seen", value: n.to_string(), rule });
            };
            let rows = prefix.rows[..n * s].iter().zip(&self.mean).enumerate();
            let observed: Vec<f64> = rows.map(|(i, (v, m))| (v - m) / self.sd[i % s]).collect();
            prefix.check_measured(&observed)?;
            let observed_scores = scores(&conditional.observed_directions, &observed);
            let processes = conditional.processes.iter();
            let centre: Vec<f64> = processes
                .map(|(kernel, w)| {
                    kernel_mean(
                        kernel,
                        w,
                        &conditional.training_scores,
                        &conditional.variances,
                        &observed_scores,
                    )
                })
                .collect();
            let (m, count) = (centre.len(), settings.samples);
            let mut rng = random_stream(settings.seed ^ n as u64, "remembered", prefix.index);
            let mut values = vec![0.0; (prefix.time - n) * s * count];
            for sample in 0..count {
                let draws: Vec<f64> = (0..m).map(|_| StandardNormal.sample(&mut rng)).collect();
                let shift = |a: usize| (0..=a).map(|k| conditional.factor[a * m + k] * draws[k]).sum::<f64>();
                let drawn: Vec<f64> = (0..m).map(|a| centre[a] + shift(a)).collect();
                for (i, row) in values.chunks_exact_mut(count).enumerate() {
                    let deviation: f64 =
                        conditional.remaining_directions.iter().zip(&drawn).map(|(d, v)| d[i] * v).sum();
                    row[sample] = (self.mean[n * s + i] + self.sd[i % s] * deviation) as f32;
                }
            }
            let mut samples = Samples { count, values };
            if settings.is_measured {
                add_measurement_noise(&mut samples, prefix.sensor.sd(), (settings.seed, prefix.index, n));
            }
            Ok(samples)
        };
        lengths.iter().map(forecast_after).collect()
    }
}
