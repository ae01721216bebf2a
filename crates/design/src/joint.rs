//! Maximum of the joint density of recordings that share their parameters, each with an initial state of its own.
//!
//! With L_r(ξ) the density of recording r with its initial state integrated out, the quadratic function of `reduced.rs`, and
//! the weight w of the prior N(0, I) of the parameters' coordinates,
//!
//! ```text
//! (1)  maximise  Σ ln L_r(ξ) - w/2 |ξ|²,    step (w I + Σ A_r)⁻¹ (Σ b_r - w ξ)
//! ```
//!
//! by Gauss-Newton steps. The density of the first samples of a recording, which determine its initial state, is divided out
//! of L_r afterwards.

use crate::error::DesignError;
use crate::explanation::Explanation;
use crate::linearise::{Start, start_readings};
use crate::projection::inverse_with_prior;
use crate::reduced::Reduced;
use crate::whiten::whiten;
use augsim_linear::PositiveInverse;
use augsim_system::{Record, shortest_difference};
use rayon::prelude::*;
use std::sync::Arc;

/// Maximum number of Gauss-Newton steps after each recording; nearly linear predictions need one or two.
const MAX_STEPS: usize = 20;
/// Predicted decrease of twice the negative log density below which the steps have converged, nats.
const MIN_DECREASE: f64 = 1e-2;
/// Shares of a Gauss-Newton step that are tried.
const STEP_SHARES: [f64; 5] = [1.0, 0.3, 0.1, 0.03, 0.01];

/// Recordings with one set of parameters for all, at the maximum of their joint density.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    /// The explanation before the recordings.
    pub prior: Arc<Explanation>,
    /// Weight of the prior of the parameters: 1, or less for a maximum of the likelihood.
    weight: f64,
    /// Coordinates of the parameters at the maximum.
    xi: Vec<f64>,
    runs: Vec<Run>,
    /// Twice the negative log density at the current point, up to a constant.
    cost: f64,
    sums: Sums,
}

/// A recording with its initial state, linearised at the current point.
#[derive(Clone, Debug)]
struct Run {
    opened: Arc<(Record, Start)>,
    /// Coordinates of the initial state.
    u: Vec<f64>,
    likelihood: Likelihood,
}

/// Likelihood of a recording, linearised at a point.
#[derive(Clone, Debug)]
struct Likelihood {
    all: Reduced,
    first: Reduced,
    /// Half the log determinant of the noise covariance of the readings after the first.
    half_log_variance: f64,
    /// Number of readings after the first.
    later: usize,
    /// Twice the negative log density of all readings and the initial state at the point, up to a constant.
    cost: f64,
}

/// Sums over recordings, with the prior of the parameters.
#[derive(Clone, Debug, Default)]
struct Sums {
    /// Constants c of the later samples given the first.
    squares: f64,
    /// Gradient of the log density of all samples, prior included.
    gradient: Vec<f64>,
    /// Gradient of the log likelihood of the first samples.
    first_gradient: Vec<f64>,
    /// Information of all samples, without the prior.
    information: Vec<Vec<f64>>,
    /// Information of the later samples given the first, without the prior.
    later_information: Vec<Vec<f64>>,
    /// Terms of the log density of the later samples that are linear in nothing, nats.
    constant: f64,
    later: usize,
}

impl Joint {
    /// No recording yet; the search for the maximum starts at the coordinates `xi`.
    pub fn new(prior: &Explanation, weight: f64, xi: Vec<f64>) -> Self {
        let mut joint = Self {
            prior: Arc::new(prior.clone()),
            weight,
            xi,
            runs: Vec::new(),
            cost: 0.0,
            sums: Sums::default(),
        };
        joint.sum();
        joint
    }

    /// Takes in recordings, and moves to the maximum of all.
    ///
    /// # Errors
    /// A recording cannot be simulated.
    pub fn add_all(&mut self, records: &[Record]) -> Result<(), DesignError> {
        let opened = |record: &Record| {
            let opened = Arc::new(self.prior.opened(record, None)?);
            let u = vec![0.0; opened.1.unknown().len()];
            let likelihood = likelihood(&self.prior, &opened, &self.xi, &u)?;
            Ok(Run { opened, u, likelihood })
        };
        let new: Vec<Run> = records.par_iter().map(opened).collect::<Result<_, DesignError>>()?;
        self.runs.extend(new);
        self.sum();
        self.maximise();
        Ok(())
    }

    /// Gauss-Newton steps to the most probable parameters and initial states.
    fn maximise(&mut self) {
        for _ in 0..MAX_STEPS {
            let Some((step, gain)) = self.step() else { break };
            let states = self.runs.iter().flat_map(|r| &r.likelihood.all.state_step);
            if gain + states.map(|step| step * step).fold(0.0, f64::max) < MIN_DECREASE {
                break;
            }
            let Some(better) = STEP_SHARES.iter().find_map(|share| self.moved(&step, *share)) else { break };
            let decrease = self.cost - better.cost;
            *self = better;
            if decrease < MIN_DECREASE {
                break;
            }
        }
    }

    /// Step to the maximum by the sums at the current point, and the decrease of twice the negative log density.
    ///
    /// A parameter at a bound stays there while the density grows outwards, where its coordinate is its own.
    fn step(&self) -> Option<(Vec<f64>, f64)> {
        let (mut information, mut gradient) = (self.sums.information.clone(), self.sums.gradient.clone());
        let values = self.prior.values_at(&self.xi);
        for (k, index) in self.prior.uncertain.iter().enumerate() {
            let row = &self.prior.factor[k];
            let is_own = (0..row.len()).all(|j| j == k || (row[j] == 0.0 && self.prior.factor[j][k] == 0.0));
            let p = &self.prior.system.parameters()[*index];
            let is_outward = (values[*index] <= p.min && gradient[k] < 0.0)
                || (values[*index] >= p.max && gradient[k] > 0.0);
            if is_own && is_outward {
                gradient[k] = 0.0;
                information[k].fill(0.0);
                information.iter_mut().for_each(|row| row[k] = 0.0);
            }
        }
        newton(&information, self.weight, &gradient)
    }

    /// The recordings linearised at a share of a step; `None` if the density is not larger there.
    fn moved(&self, step: &[f64], share: f64) -> Option<Self> {
        self.at(step, share).filter(|there| there.cost < self.cost)
    }

    /// Whether the density falls about as that of a normal distribution with its curvature at the maximum.
    ///
    /// Two standard deviations along each column of `factor`, the factor of the covariance of the coordinates, must be
    /// between one and four by the density.
    pub fn is_normal(&self, factor: &[Vec<f64>]) -> bool {
        let k = self.xi.len();
        let is_normal = |column: usize, sign: f64| {
            let scaled = |i: usize| match self.prior.factor[i][i] {
                sd if sd > 0.0 => 2.0 * sign * factor[i][column] / sd,
                _ => 0.0,
            };
            let step: Vec<f64> = (0..k).map(scaled).collect();
            self.at(&step, 1.0).is_some_and(|there| (1.0..=16.0).contains(&(there.cost - self.cost)))
        };
        (0..k).all(|column| is_normal(column, 1.0) && is_normal(column, -1.0))
    }

    /// The recordings linearised at a share of a step; `None` if they cannot be simulated there.
    fn at(&self, step: &[f64], share: f64) -> Option<Self> {
        let xi: Vec<f64> = self.xi.iter().zip(step).map(|(xi, d)| xi + share * d).collect();
        let moved = |run: &Run| {
            let all = &run.likelihood.all;
            let state = |((u, own), row): ((&f64, &f64), &Vec<f64>)| {
                u + share * (own - row.iter().zip(step).map(|(a, b)| a * b).sum::<f64>())
            };
            let u: Vec<f64> =
                run.u.iter().zip(&all.state_step).zip(&all.state_by_parameter).map(state).collect();
            let likelihood = likelihood(&self.prior, &run.opened, &xi, &u).ok()?;
            Some(Run { opened: run.opened.clone(), u, likelihood })
        };
        let runs: Vec<Run> = self.runs.par_iter().map(moved).collect::<Option<_>>()?;
        let mut there = Self { prior: self.prior.clone(), xi, runs, sums: Sums::default(), ..*self };
        there.sum();
        Some(there)
    }

    /// Sums the runs at the current point.
    fn sum(&mut self) {
        let k = self.xi.len();
        let mut sums = Sums {
            gradient: self.xi.iter().map(|xi| -self.weight * xi).collect(),
            first_gradient: vec![0.0; k],
            information: vec![vec![0.0; k]; k],
            later_information: vec![vec![0.0; k]; k],
            ..Sums::default()
        };
        self.cost = self.weight * self.prior_squares();
        for Likelihood { all, first, half_log_variance, later, cost } in
            self.runs.iter().map(|r| &r.likelihood)
        {
            sums.squares += all.squares - first.squares;
            sums.later += later;
            sums.constant -= all.half_log_determinant - first.half_log_determinant + half_log_variance;
            for i in 0..k {
                sums.gradient[i] += all.gradient[i];
                sums.first_gradient[i] += first.gradient[i];
                for j in 0..k {
                    sums.information[i][j] += all.information[i][j];
                    sums.later_information[i][j] += all.information[i][j] - first.information[i][j];
                }
            }
            self.cost += cost;
        }
        sums.constant -= 0.5 * sums.later as f64 * std::f64::consts::TAU.ln();
        self.sums = sums;
    }

    /// Logarithm of the density of the recordings with the parameters integrated out (Laplace), nats; for weight 1.
    pub fn log_density(&self) -> f64 {
        let Some(inverted) = inverse(&self.sums.later_information, 1.0) else { return f64::NAN };
        self.log_likelihood() - 0.5 * self.prior_squares() - inverted.half_log_determinant
    }

    /// Logarithm of the likelihood of the recordings at the maximum, nats.
    pub fn log_likelihood(&self) -> f64 {
        // At the maximum of the density of all samples only the first ones leave a gradient.
        let gradient: Vec<f64> = self.sums.first_gradient.iter().map(|g| -g).collect();
        let Some((_, gain)) = newton(&self.sums.later_information, self.weight, &gradient) else {
            return f64::NAN;
        };
        self.sums.constant - 0.5 * (self.sums.squares - gain)
    }

    /// Logarithm of the largest likelihood of the recordings times exp(-a/2 |ξ|²) (1 - a)^(-k/2), nats; for weight 1.
    pub fn log_discounted(&self, a: f64) -> f64 {
        let sums = &self.sums;
        let gradient: Vec<f64> = (sums.gradient.iter().zip(&sums.first_gradient).zip(&self.xi))
            .map(|((all, first), xi)| all - first + (1.0 - a) * xi)
            .collect();
        let Some((_, gain)) = newton(&sums.later_information, a, &gradient) else { return f64::NAN };
        let cost = -0.5 * self.xi.len() as f64 * (1.0 - a).ln();
        sums.constant - 0.5 * (sums.squares + a * self.prior_squares() - gain) + cost
    }

    /// Sum of the squares of the standardised prediction errors and parameters, and the number of errors.
    pub fn squares(&self) -> (f64, usize) {
        (self.sums.squares + self.prior_squares(), self.sums.later)
    }

    fn prior_squares(&self) -> f64 {
        self.xi.iter().map(|xi| xi * xi).sum()
    }

    /// The explanation with the parameters and the covariance after the recordings.
    pub fn updated(&self) -> Explanation {
        match inverse(&self.sums.information, 1.0) {
            Some(PositiveInverse { inverse, .. }) => self.prior.after(&inverse, &self.xi),
            None => Explanation::clone(&self.prior),
        }
    }
}

/// Linearises the likelihood of a recording at the coordinates `xi` of the parameters and `u` of the initial state.
fn likelihood(
    e: &Explanation,
    (record, start): &(Record, Start),
    xi: &[f64],
    u: &[f64],
) -> Result<Likelihood, DesignError> {
    let values = e.values_at(xi);
    let out = e.simulate(record, &values, &start.at(u), &e.seeds(start))?;
    let channels = &e.system.schema().channels;
    let residual = |sample: usize, output: usize, _| {
        let measured = record.values[output].get(sample).copied().unwrap_or(f64::NAN);
        shortest_difference(measured - out.value(sample, output), channels[output].period)
    };
    let mut columns = e.columns((&out, &values), start, 1, residual);
    let intervals = e.intervals(record, &values, &out)?;
    let half_logs = whiten(&e.noise, &record.times, &mut columns, &intervals);
    let (rows, first_rows) = (columns.readings.len(), start_readings(e, &columns, start));
    let not_finite = || DesignError::NotFinite { name: e.name.clone(), record: record.id.clone() };
    let all = Reduced::new(&columns, rows, xi.len(), u).ok_or_else(not_finite)?;
    let first = Reduced::new(&columns, first_rows, xi.len(), u).ok_or_else(not_finite)?;
    let residuals = columns.values.chunks_exact(columns.count).map(|row| row[0] * row[0]).sum::<f64>();
    let states: f64 = u.iter().map(|u| u * u).sum();
    Ok(Likelihood {
        all,
        first,
        half_log_variance: half_logs[first_rows..].iter().sum(),
        later: rows - first_rows,
        cost: residuals + states + 2.0 * half_logs.iter().sum::<f64>(),
    })
}

/// Inverse of `prior` I + A and half the logarithm of its determinant, with the rows of A; `None` if it is not positive definite.
fn inverse(information: &[Vec<f64>], prior: f64) -> Option<PositiveInverse> {
    inverse_with_prior(information.len(), prior, |i, j| information[i][j])
}

/// Step to the maximum of a quadratic log density with this gradient, and the decrease of twice its negative.
fn newton(information: &[Vec<f64>], prior: f64, gradient: &[f64]) -> Option<(Vec<f64>, f64)> {
    let PositiveInverse { inverse, .. } = inverse(information, prior)?;
    let k = gradient.len();
    let step: Vec<f64> = (0..k).map(|i| (0..k).map(|j| inverse[(i, j)] * gradient[j]).sum()).collect();
    let gain = step.iter().zip(gradient).map(|(d, g)| d * g).sum();
    Some((step, gain))
}
