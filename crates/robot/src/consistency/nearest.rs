//! Consistent parameters of all bodies that agree with identified base parameters and stay close to those of the description
//! file.

use augsim_linear::{Mat, invert_positive_definite, solve_positive_definite};

use super::{
    LogCholesky, Parameters, from_log_cholesky, log_cholesky, parameter_derivatives, pseudo_inertia,
    pseudo_inertia_derivatives,
};

/// Factor by which the weight of the distance from the prior falls from one trial to the next.
const WEIGHT_STEP: f64 = 0.25;

/// Number of trials of the weight.
///
/// The last one is 0.25^24, 4e-15, which is rounding beside the base parameters' errors.
const MAX_WEIGHTS: usize = 25;

/// Most iterations at one weight; the next weight begins where the last one ended.
const MAX_ITERATIONS: usize = 60;

/// Relative decrease of the objective that ends the iterations.
const MIN_DECREASE: f64 = 1e-10;

/// Identified base parameters: `factors * parameters = values`, up to errors with this covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseEstimate {
    /// Factors, `[base][10 * bodies]`; the parameters of a body are in the order of the module.
    ///
    /// Contributions of other parameters, such as an armature, are subtracted from the values beforehand.
    pub factors: Vec<Vec<f64>>,
    /// Values, `[base]`.
    pub values: Vec<f64>,
    /// Covariance of the errors of the values, `[base][base]`.
    pub covariance: Vec<Vec<f64>>,
}

/// Consistent parameters, and how well they agree with the identified values.
#[derive(Debug, Clone, PartialEq)]
pub struct Consistent {
    /// Parameters of each body, all consistent.
    pub parameters: Vec<Parameters>,
    /// Squared deviation of the base parameters from the identified ones in units of the covariance.
    pub chi_square: f64,
    /// Whether the base parameters are within their uncertainty.
    ///
    /// `chi_square` is then at most the number of base parameters, its expected value for the true parameters.
    ///
    /// If not, the identified values are those of no arm that can exist.
    pub is_within_uncertainty: bool,
    /// Squared distance from the prior, without unit.
    ///
    /// It is 1 where one body has twice its mass and its moments.
    pub squared_distance: f64,
}

/// Why no consistent parameters can be found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ConsistencyError {
    /// The prior parameters of a body are not consistent.
    #[error(
        "the inertia of body {body} in the description file is that of no real body; raise it by `raise_to_consistent` first"
    )]
    PriorInconsistent {
        /// Index of the body, from 0.
        body: usize,
    },
    /// Numbers of rows or columns do not agree.
    #[error(
        "{base} base parameters and {bodies} bodies need {base} rows of {} factors, {base} values and a covariance of {base} x {base}",
        10 * bodies
    )]
    Shape {
        /// Number of base parameters, by the rows of factors.
        base: usize,
        /// Number of bodies.
        bodies: usize,
    },
    /// The covariance is not positive definite.
    #[error("the covariance of the base parameters is not positive definite")]
    Covariance,
    /// A factor or value is not a finite number.
    #[error("row {base} of the base parameters has a value that is not a finite number")]
    NotFinite {
        /// Index of the base parameter, from 0.
        base: usize,
    },
}

/// Finds consistent parameters close to a prior that agree with identified base parameters.
///
/// All base parameters stay within their uncertainty if the parameters of real bodies allow it.
///
/// With the coordinates x of all bodies (log-Cholesky), x0 of the prior, the base parameters' error
/// `e(x) = factors * parameters(x) - values` and their covariance C, it minimises
///
/// ```text
/// e^T C^-1 e + w (x - x0)^T M (x - x0)        (3)
/// ```
///
/// M is the metric of positive definite matrices at the prior, `1/2 trace(J^-1 dJ J^-1 dJ)`, which does not depend on frames
/// and units (the constant pullback of Lee, Wensing and Park, "Geometric robot dynamic identification", T-RO 2020). The weight
/// w falls from 1 until the first term is at most the number of base parameters. The method is Gauss-Newton, damped by M
/// (Levenberg and Marquardt).
///
/// # Errors
/// A prior that is not consistent, wrong shapes, values that are not finite, a covariance that is not positive definite.
pub fn nearest_consistent(
    estimate: &BaseEstimate,
    prior: &[Parameters],
) -> Result<Consistent, ConsistencyError> {
    let problem = Problem::new(estimate, prior)?;
    let mut x = problem.prior.clone();
    let limit = estimate.values.len() as f64;
    let mut weight = 1.0;
    for _ in 0..MAX_WEIGHTS {
        if problem.chi_square(&x) <= limit {
            break;
        }
        x = problem.minimise(x, weight);
        weight *= WEIGHT_STEP;
    }
    let chi_square = problem.chi_square(&x);
    Ok(Consistent {
        parameters: x.iter().map(from_log_cholesky).collect(),
        chi_square,
        is_within_uncertainty: chi_square <= limit,
        squared_distance: problem.squared_distance(&x),
    })
}

struct Problem<'a> {
    estimate: &'a BaseEstimate,
    /// Inverse of the covariance, `[base, base]`.
    precision: Mat<f64>,
    prior: Vec<LogCholesky>,
    /// Metric M of each body at the prior.
    metrics: Vec<[[f64; 10]; 10]>,
}

impl<'a> Problem<'a> {
    fn new(estimate: &'a BaseEstimate, prior: &[Parameters]) -> Result<Problem<'a>, ConsistencyError> {
        let (base, bodies) = (estimate.factors.len(), prior.len());
        let is_square =
            estimate.covariance.len() == base && estimate.covariance.iter().all(|row| row.len() == base);
        let has_factors = estimate.factors.iter().all(|row| row.len() == 10 * bodies);
        if !is_square || !has_factors || estimate.values.len() != base {
            return Err(ConsistencyError::Shape { base, bodies });
        }
        let is_finite =
            |k: usize| estimate.values[k].is_finite() && estimate.factors[k].iter().all(|f| f.is_finite());
        if let Some(base) = (0..base).find(|k| !is_finite(*k)) {
            return Err(ConsistencyError::NotFinite { base });
        }
        let lower = Mat::from_fn(base, base, |i, j| if i >= j { estimate.covariance[i][j] } else { 0.0 });
        let precision = invert_positive_definite(lower).ok_or(ConsistencyError::Covariance)?.inverse;
        let coordinates =
            |(body, parameters)| log_cholesky(parameters).ok_or(ConsistencyError::PriorInconsistent { body });
        let prior_coordinates =
            prior.iter().enumerate().map(coordinates).collect::<Result<Vec<LogCholesky>, _>>()?;
        let metric =
            |(body, coordinates)| metric(coordinates).ok_or(ConsistencyError::PriorInconsistent { body });
        let metrics = prior_coordinates.iter().enumerate().map(metric).collect::<Result<Vec<_>, _>>()?;
        Ok(Problem { estimate, precision, prior: prior_coordinates, metrics })
    }

    /// Errors of the base parameters, `[base]`.
    fn errors(&self, x: &[LogCholesky]) -> Vec<f64> {
        let parameters: Vec<f64> = x.iter().flat_map(from_log_cholesky).collect();
        let rows = self.estimate.factors.iter().zip(&self.estimate.values);
        rows.map(|(row, value)| row.iter().zip(&parameters).map(|(f, p)| f * p).sum::<f64>() - value)
            .collect()
    }

    fn chi_square(&self, x: &[LogCholesky]) -> f64 {
        let errors = self.errors(x);
        let n = errors.len();
        (0..n).map(|i| errors[i] * (0..n).map(|j| self.precision[(i, j)] * errors[j]).sum::<f64>()).sum()
    }

    /// Metric of each body times its displacement from the prior.
    fn pulls(&self, x: &[LogCholesky]) -> Vec<f64> {
        let bodies = x.iter().zip(&self.prior).zip(&self.metrics);
        bodies
            .flat_map(|((x, prior), metric)| {
                metric.map(|row| (0..10).map(|k| row[k] * (x[k] - prior[k])).sum::<f64>())
            })
            .collect()
    }

    fn squared_distance(&self, x: &[LogCholesky]) -> f64 {
        let displacements =
            x.iter().zip(&self.prior).flat_map(|(x, prior)| (0..10).map(move |k| x[k] - prior[k]));
        self.pulls(x).iter().zip(displacements).map(|(pull, displacement)| pull * displacement).sum()
    }

    /// Objective (3).
    fn objective(&self, x: &[LogCholesky], weight: f64) -> f64 {
        self.chi_square(x) + weight * self.squared_distance(x)
    }

    /// Minimum of (3) from a start.
    fn minimise(&self, mut x: Vec<LogCholesky>, weight: f64) -> Vec<LogCholesky> {
        let mut value = self.objective(&x, weight);
        let mut damping = weight;
        for _ in 0..MAX_ITERATIONS {
            let (hessian, gradient) = self.normal_equations(&x, weight);
            let Some((next, next_value)) =
                self.damped_step(&x, value, weight, &hessian, &gradient, &mut damping)
            else {
                break;
            };
            let decrease = value - next_value;
            (x, value) = (next, next_value);
            if decrease <= MIN_DECREASE * value {
                break;
            }
        }
        x
    }

    /// Step that decreases the objective, with more damping after each failure; `None` if there is none.
    fn damped_step(
        &self,
        x: &[LogCholesky],
        value: f64,
        weight: f64,
        hessian: &Mat<f64>,
        gradient: &Mat<f64>,
        damping: &mut f64,
    ) -> Option<(Vec<LogCholesky>, f64)> {
        // 30 failures raise the damping by 1e30: then the step is below rounding.
        for _ in 0..30 {
            let damped = Mat::from_fn(hessian.nrows(), hessian.nrows(), |i, j| {
                let metric = if i / 10 == j / 10 { self.metrics[i / 10][i % 10][j % 10] } else { 0.0 };
                hessian[(i, j)] + *damping * metric
            });
            if let Some(step) = solve_positive_definite(&damped, gradient) {
                let moved = |(body, x): (usize, &LogCholesky)| {
                    std::array::from_fn(|k| x[k] - step[(10 * body + k, 0)])
                };
                let next: Vec<LogCholesky> = x.iter().enumerate().map(moved).collect();
                let next_value = self.objective(&next, weight);
                if next_value < value {
                    *damping *= 0.1;
                    return Some((next, next_value));
                }
            }
            *damping *= 10.0;
        }
        None
    }

    /// Half the Hessian (Gauss-Newton) and half the gradient of (3).
    fn normal_equations(&self, x: &[LogCholesky], weight: f64) -> (Mat<f64>, Mat<f64>) {
        let (base, n) = (self.estimate.values.len(), 10 * x.len());
        let derivatives: Vec<_> = x.iter().map(parameter_derivatives).collect();
        let jacobian: Vec<Vec<f64>> = (0..n)
            .map(|j| {
                let (body, coordinate) = (j / 10, j % 10);
                let own = |row: &Vec<f64>| {
                    (0..10).map(|k| row[10 * body + k] * derivatives[body][k][coordinate]).sum()
                };
                self.estimate.factors.iter().map(own).collect()
            })
            .collect();
        let weighted: Vec<Vec<f64>> = jacobian
            .iter()
            .map(|column| {
                (0..base).map(|i| (0..base).map(|k| self.precision[(i, k)] * column[k]).sum()).collect()
            })
            .collect();
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (errors, pulls) = (self.errors(x), self.pulls(x));
        let gradient = Mat::from_fn(n, 1, |j, _| product(&weighted[j], &errors) + weight * pulls[j]);
        let mut hessian = Mat::from_fn(n, n, |i, j| product(&weighted[i], &jacobian[j]));
        for (body, metric) in self.metrics.iter().enumerate() {
            for (i, j) in (0..10).flat_map(|i| (0..10).map(move |j| (i, j))) {
                hessian[(10 * body + i, 10 * body + j)] += weight * metric[i][j];
            }
        }
        (hessian, gradient)
    }
}

/// Metric of positive definite matrices in log-Cholesky coordinates.
///
/// `1/2 trace(J^-1 dJ_i J^-1 dJ_k)`; `None` if J is singular in rounding.
fn metric(coordinates: &LogCholesky) -> Option<[[f64; 10]; 10]> {
    let j = pseudo_inertia(&from_log_cholesky(coordinates));
    let lower = Mat::from_fn(4, 4, |i, k| if i >= k { j[i][k] } else { 0.0 });
    let inverse = invert_positive_definite(lower)?.inverse;
    let relative = pseudo_inertia_derivatives(coordinates).map(|derivative| {
        let mut product = [[0.0; 4]; 4];
        for (i, k) in (0..4).flat_map(|i| (0..4).map(move |k| (i, k))) {
            product[i][k] = (0..4).map(|n| inverse[(i, n)] * derivative[n][k]).sum();
        }
        product
    });
    let trace = |a: &[[f64; 4]; 4], b: &[[f64; 4]; 4]| -> f64 {
        (0..4).flat_map(|i| (0..4).map(move |k| (i, k))).map(|(i, k)| a[i][k] * b[k][i]).sum()
    };
    Some(std::array::from_fn(|i| std::array::from_fn(|k| 0.5 * trace(&relative[i], &relative[k]))))
}
