//! Evidence of new recordings for an explanation: their mixture density and their maximised likelihood.
//!
//! The parameters have the coordinates ξ under the normal distribution N(0, I) that all earlier data leave. With
//! L_r(ξ) the density of the later samples of recording r given its first ones, its initial state integrated out, as in
//! `reduced.rs`,
//!
//! ```text
//! (1)  ln p = ln ∫ Π L_r(ξ) N(ξ; 0, I) dξ
//!           = ln Π L_r(ξ̂) - 1/2 |ξ̂|² - 1/2 ln |I + Σ A_r|                      mixture
//! (2)  ln q = max over ξ of { ln Π L_r(ξ) - a/2 |ξ|² } - k/2 ln(1 - a)          maximised likelihood
//! ```
//!
//! for k parameters and a = 1/2. Formula (1) is Laplace's approximation at the most probable ξ̂ of all recordings together
//! (Tierney and Kadane 1986). The first samples, which determine the initial state, are divided out.
//!
//! Why p_i / q_j tests explanation j at every value of its parameters: universal inference (Wasserman, Ramdas and
//! Balakrishnan 2020) bounds the unknown likelihood of j by its maximum. For the true ξ* of j
//!
//! ```text
//! (3)  p_i / q_j <= (1 - a)^(k/2) exp(a/2 |ξ*|²) p_i / Π L_r(ξ*)
//! ```
//!
//! where p_i / Π L_r has mean 1 over the new recordings, as p_i is a density of them. The factor before it has mean 1 over the
//! earlier data, from which ξ* is k standard normal numbers. So the product is an e-value. With a = 0 the null could contradict all
//! earlier data at no cost; with a near 1 the last term of (2) grows without bound. a = 1/2 costs 0.35 nats for each parameter, and
//! leaves half of what earlier data say against other values.

use crate::error::DesignError;
use crate::explanation::Explanation;
use crate::linearise::{Start, start_readings};
use crate::reduced::Reduced;
use crate::verdict::Tally;
use crate::whiten::whiten;
use augsim_linear::{Mat, invert_positive_definite};
use augsim_system::{Record, shortest_difference};
use rayon::prelude::*;

/// Share a of the earlier data's evidence about the parameters that formula (2) keeps.
const KEPT_SHARE: f64 = 0.5;
/// Maximum number of Gauss-Newton steps after each recording; nearly linear predictions need one or two.
const MAX_STEPS: usize = 20;
/// Predicted decrease of twice the negative log density below which the steps have converged, nats.
const MIN_DECREASE: f64 = 1e-3;
/// Shares of a Gauss-Newton step that are tried.
const STEP_SHARES: [f64; 5] = [1.0, 0.3, 0.1, 0.03, 0.01];

/// Evidence of recordings, and the parameters after them.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// The explanation before the recordings.
    prior: Explanation,
    /// Coordinates of the most probable parameters.
    xi: Vec<f64>,
    runs: Vec<Run>,
    /// Twice the negative log density at the current point, up to a constant.
    cost: f64,
    sums: Sums,
}

/// A recording with its initial state, linearised at the current point.
#[derive(Clone, Debug)]
struct Run {
    record: Record,
    start: Start,
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

impl Evidence {
    /// No recording yet: the parameters are distributed as the explanation says.
    pub fn new(prior: &Explanation) -> Self {
        Self::starting_at(prior, vec![0.0; prior.uncertain.len()])
    }

    /// No recording yet; the search for the most probable parameters starts at the coordinates `xi`.
    pub(crate) fn starting_at(prior: &Explanation, xi: Vec<f64>) -> Self {
        let mut evidence =
            Self { prior: prior.clone(), xi, runs: Vec::new(), cost: 0.0, sums: Sums::default() };
        evidence.sum();
        evidence
    }

    /// Takes in a recording.
    ///
    /// # Errors
    /// The recording cannot be simulated, or the density is not finite.
    pub fn add(&mut self, record: &Record) -> Result<(), DesignError> {
        self.add_all(std::slice::from_ref(record))
    }

    /// Takes in recordings that are judged together.
    ///
    /// # Errors
    /// As [`Evidence::add`].
    pub fn add_all(&mut self, records: &[Record]) -> Result<(), DesignError> {
        let opened = |record: &Record| {
            let (record, start) = self.prior.opened(record, None)?;
            let u = vec![0.0; start.unknown().len()];
            let likelihood = likelihood(&self.prior, &record, &start, &self.xi, &u)?;
            Ok(Run { record, start, u, likelihood })
        };
        let new: Vec<Run> = records.par_iter().map(opened).collect::<Result<_, DesignError>>()?;
        self.runs.extend(new);
        self.sum();
        self.maximise();
        match self.log_density().is_finite() && self.log_maximum().is_finite() {
            true => Ok(()),
            false => Err(DesignError::NotFinite {
                name: self.prior.name.clone(),
                record: records.last().map(|r| r.id.clone()).unwrap_or_default(),
            }),
        }
    }

    /// Gauss-Newton steps to the most probable parameters and initial states.
    fn maximise(&mut self) {
        for _ in 0..MAX_STEPS {
            let Some((step, gain)) = newton(&self.sums.information, 1.0, &self.sums.gradient) else { break };
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

    /// The evidence linearised at a share of a step; `None` if the density is not larger there.
    fn moved(&self, step: &[f64], share: f64) -> Option<Self> {
        let xi: Vec<f64> = self.xi.iter().zip(step).map(|(xi, d)| xi + share * d).collect();
        let moved = |run: &Run| {
            let all = &run.likelihood.all;
            let state = |((u, own), row): ((&f64, &f64), &Vec<f64>)| {
                u + share * (own - row.iter().zip(step).map(|(a, b)| a * b).sum::<f64>())
            };
            let u: Vec<f64> =
                run.u.iter().zip(&all.state_step).zip(&all.state_by_parameter).map(state).collect();
            let likelihood = likelihood(&self.prior, &run.record, &run.start, &xi, &u).ok()?;
            Some(Run { record: run.record.clone(), start: run.start.clone(), u, likelihood })
        };
        let runs: Vec<Run> = self.runs.par_iter().map(moved).collect::<Option<_>>()?;
        let mut there =
            Self { prior: self.prior.clone(), xi, runs, cost: f64::INFINITY, sums: Sums::default() };
        there.sum();
        (there.cost < self.cost).then_some(there)
    }

    /// Sums the runs at the current point.
    fn sum(&mut self) {
        let k = self.xi.len();
        let mut sums = Sums {
            gradient: self.xi.iter().map(|xi| -xi).collect(),
            first_gradient: vec![0.0; k],
            information: vec![vec![0.0; k]; k],
            later_information: vec![vec![0.0; k]; k],
            ..Sums::default()
        };
        self.cost = self.xi.iter().map(|xi| xi * xi).sum();
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

    /// Logarithm of the mixture density (1) of the recordings, nats.
    pub fn log_density(&self) -> f64 {
        // At the most probable point of all samples only the first ones leave a gradient.
        let gradient: Vec<f64> = self.sums.first_gradient.iter().map(|g| -g).collect();
        let Some((_, gain)) = newton(&self.sums.later_information, 1.0, &gradient) else { return f64::NAN };
        let Some(determinant) = half_log_determinant(&self.sums.later_information, 1.0) else {
            return f64::NAN;
        };
        self.sums.constant - 0.5 * (self.sums.squares + self.prior_squares() - gain) - determinant
    }

    /// Logarithm of the maximised likelihood (2) of the recordings, nats.
    pub fn log_maximum(&self) -> f64 {
        let sums = &self.sums;
        let gradient: Vec<f64> = (sums.gradient.iter().zip(&sums.first_gradient).zip(&self.xi))
            .map(|((all, first), xi)| all - first + (1.0 - KEPT_SHARE) * xi)
            .collect();
        let Some((_, gain)) = newton(&sums.later_information, KEPT_SHARE, &gradient) else { return f64::NAN };
        let cost = -0.5 * self.xi.len() as f64 * (1.0 - KEPT_SHARE).ln();
        sums.constant - 0.5 * (sums.squares + KEPT_SHARE * self.prior_squares() - gain) + cost
    }

    fn prior_squares(&self) -> f64 {
        self.xi.iter().map(|xi| xi * xi).sum()
    }

    /// The explanation with the parameters and the covariance after the recordings.
    pub fn updated(&self) -> Explanation {
        match inverse(&self.sums.information, 1.0) {
            Some((inverse, _)) => self.prior.after(&inverse, &self.xi),
            None => self.prior.clone(),
        }
    }

    /// Evidence for a judgement.
    pub fn tally(&self) -> Tally {
        Tally {
            log_weight: self.prior.log_weight,
            log_e_value: self.prior.log_e_value,
            log_density: self.log_density(),
            log_maximum: self.log_maximum(),
            squares: self.sums.squares + self.prior_squares(),
            count: self.sums.later,
        }
    }
}

/// Linearises the likelihood of a recording at the coordinates `xi` of the parameters and `u` of the initial state.
fn likelihood(
    e: &Explanation,
    record: &Record,
    start: &Start,
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

/// Inverse of `prior` I + A, and half the logarithm of its determinant; `None` if it is not positive definite.
fn inverse(information: &[Vec<f64>], prior: f64) -> Option<(Mat<f64>, f64)> {
    let entry = |i: usize, j: usize| match i.cmp(&j) {
        std::cmp::Ordering::Less => 0.0,
        std::cmp::Ordering::Equal => prior + information[i][i],
        std::cmp::Ordering::Greater => information[i][j],
    };
    let k = information.len();
    let inverted = invert_positive_definite(Mat::from_fn(k, k, entry))?;
    Some((inverted.inverse, inverted.half_log_determinant))
}

fn half_log_determinant(information: &[Vec<f64>], prior: f64) -> Option<f64> {
    inverse(information, prior).map(|(_, determinant)| determinant)
}

/// Step to the maximum of a quadratic log density with this gradient, and the decrease of twice its negative.
fn newton(information: &[Vec<f64>], prior: f64, gradient: &[f64]) -> Option<(Vec<f64>, f64)> {
    let (inverse, _) = inverse(information, prior)?;
    let k = gradient.len();
    let step: Vec<f64> = (0..k).map(|i| (0..k).map(|j| inverse[(i, j)] * gradient[j]).sum()).collect();
    let gain = step.iter().zip(gradient).map(|(d, g)| d * g).sum();
    Some((step, gain))
}
