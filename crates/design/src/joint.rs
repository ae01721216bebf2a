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

use crate::bounded_step::{Bound, bounded_step};
use crate::error::DesignError;
use crate::explanation::Explanation;
use crate::linearise::{Start, declared_places, start_readings};
use crate::projection::inverse_with_prior;
use crate::reduced::Reduced;
use crate::whiten::whiten;
use augsim_linear::PositiveInverse;
use augsim_system::{Offsets, Record, Simulated, Task, shortest_difference};
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

/// A prepared recording with the prior and the coordinates of its initial state.
type Opened = (Arc<(Record, Start)>, Vec<f64>);

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
    /// Half the log determinants of the precisions of the initial states with a declared distribution.
    half_log_declared: f64,
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
        let opened = |record: &Record| -> Result<Opened, DesignError> {
            let opened = Arc::new(self.prior.opened(record, None)?);
            let u = vec![0.0; opened.1.unknown().len()];
            Ok((opened, u))
        };
        self.add_opened(records.par_iter().map(opened).collect::<Result<_, DesignError>>()?)
    }

    /// As [`Joint::add_all`], for recordings that are opened.
    fn add_opened(&mut self, new: Vec<Opened>) -> Result<(), DesignError> {
        self.runs.extend(linearised(&self.prior, &self.xi, new)?);
        self.sum();
        // From rough initial states the parameters would take up what is the initial states' error, and end far away.
        self.settle_states();
        self.maximise();
        Ok(())
    }

    /// Predicted decrease of twice the negative log density by steps of the initial states alone, nats.
    fn state_gain(&self) -> f64 {
        self.runs.iter().map(|run| run.likelihood.all.state_gain).sum()
    }

    /// Gauss-Newton steps to the most probable initial states with the parameters as they are.
    fn settle_states(&mut self) {
        let still = vec![0.0; self.xi.len()];
        self.descend(|_| Some((still.clone(), 0.0)), |_| true);
    }

    /// The recordings, each with its current unknowns.
    fn opened(&self) -> Vec<Opened> {
        self.runs.iter().map(|run| (run.opened.clone(), run.u.clone())).collect()
    }

    /// These recordings and those of `other`, at the maximum of their density with this prior.
    ///
    /// # Errors
    /// A recording cannot be simulated.
    pub fn joined(&self, other: &Self) -> Result<Self, DesignError> {
        let mut joined = self.clone();
        joined.add_opened(other.opened())?;
        Ok(joined)
    }

    /// Gauss-Newton steps to the most probable parameters and initial states.
    fn maximise(&mut self) {
        // A linearisation without positive definite informations is of no use.
        self.descend(Self::step, Self::has_informations);
    }

    /// Gauss-Newton steps until the density hardly grows. `step` gives that of the parameters and the decrease of twice the
    /// negative log density that it promises; only points where `is_usable` are moved to.
    fn descend(
        &mut self,
        step: impl Fn(&Self) -> Option<(Vec<f64>, f64)>,
        is_usable: impl Fn(&Self) -> bool,
    ) {
        for _ in 0..MAX_STEPS {
            let Some((step, gain)) = step(self) else { break };
            if gain + self.state_gain() < MIN_DECREASE {
                break;
            }
            let moved = |share: &f64| {
                self.at(&step, *share).filter(|there| there.cost < self.cost && is_usable(there))
            };
            let Some(better) = STEP_SHARES.iter().find_map(moved) else { break };
            let decrease = self.cost - better.cost;
            *self = better;
            if decrease < MIN_DECREASE {
                break;
            }
        }
    }

    /// Step to the maximum by the sums at the current point within the bounds, and the decrease of twice the negative log density.
    ///
    /// Without the bounds the coordinates would run on beyond them, where the values stay at the bound, and be too far away to
    /// come back when a later recording asks for it.
    fn step<'a>(&'a self) -> Option<(Vec<f64>, f64)> {
        let PositiveInverse { inverse, .. } = inverse(&self.sums.information, self.weight)?;
        let rows = self.prior.uncertain.iter().zip(&self.prior.factor);
        let bound = |(index, row): (&usize, &'a Vec<f64>)| {
            let change: f64 = row.iter().zip(&self.xi).map(|(l, x)| l * x).sum();
            let [low, high] = self.prior.room(*index);
            Bound { row, low: (low - change).min(0.0), high: (high - change).max(0.0) }
        };
        let bounds: Vec<Bound<'_>> = rows.map(bound).collect();
        Some(bounded_step(&inverse, &self.sums.gradient, &bounds))
    }

    /// Whether the informations of the recordings are positive definite with the prior. They are not where the sensitivities
    /// exceed the precision of their products, as in unstable motions.
    fn has_informations(&self) -> bool {
        let informations = [&self.sums.information, &self.sums.later_information];
        informations.into_iter().all(|information| inverse(information, self.weight).is_some())
    }

    /// The recordings linearised at a share of a step; `None` if they cannot be simulated there.
    fn at(&self, step: &[f64], share: f64) -> Option<Self> {
        let xi: Vec<f64> = self.xi.iter().zip(step).map(|(xi, d)| xi + share * d).collect();
        let moved = |run: &Run| -> Opened {
            let all = &run.likelihood.all;
            let state = |((u, own), row): ((&f64, &f64), &Vec<f64>)| {
                u + share * (own - row.iter().zip(step).map(|(a, b)| a * b).sum::<f64>())
            };
            let u: Vec<f64> =
                run.u.iter().zip(&all.state_step).zip(&all.state_by_parameter).map(state).collect();
            (run.opened.clone(), u)
        };
        let runs = linearised(&self.prior, &xi, self.runs.iter().map(moved).collect()).ok()?;
        let mut there = Self { prior: self.prior.clone(), xi, runs, sums: Sums::default(), ..*self };
        there.sum();
        Some(there)
    }

    /// The recordings at the maximum of their density with the prior N(`centre`, I); its coordinates are relative to `centre`.
    ///
    /// `None` if they cannot be simulated at `centre`.
    pub fn pulled_to(&self, centre: &[f64]) -> Option<Self> {
        let prior = Explanation { values: self.prior.values_at(centre), ..(*self.prior).clone() };
        let mut pulled = Self::new(&prior, 1.0, vec![0.0; centre.len()]);
        pulled.add_opened(self.opened()).ok()?;
        Some(pulled)
    }

    /// The recordings at the coordinates `xi` of the parameters, with the most probable initial states there; `None` if they cannot
    /// be simulated there.
    pub fn moved_to(&self, xi: &[f64]) -> Option<Self> {
        let step: Vec<f64> = xi.iter().zip(&self.xi).map(|(to, from)| to - from).collect();
        let mut there = self.at(&step, 1.0)?;
        there.settle_states();
        Some(there)
    }

    /// Moves to the maximum that begins at the coordinates `xi`, if the recordings are more probable there than at the current one.
    pub fn start_from(&mut self, xi: &[f64]) {
        let is_better = |there: &Self| self.cost - there.cost > MIN_DECREASE && there.has_informations();
        if let Some(mut there) = self.moved_to(xi).filter(is_better) {
            there.maximise();
            *self = there;
        }
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
            sums.half_log_declared += all.half_log_declared;
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

    /// Logarithm of the distribution of the parameters after the recordings at the current coordinates ξ, nats, up to a constant:
    /// of Π P_r(ξ) exp(-w/2 |ξ|²), with the likelihood P_r of formula (3) in `reduced.rs`.
    pub fn log_posterior(&self) -> f64 {
        -0.5 * self.cost - self.sums.half_log_declared
    }

    /// Information Σ A_r of the recordings, after their first samples, on the parameters; without the prior.
    pub fn later_information(&self) -> &[Vec<f64>] {
        &self.sums.later_information
    }

    /// Coordinates ξ of the parameters.
    pub fn xi(&self) -> &[f64] {
        &self.xi
    }

    /// Number of recordings.
    pub fn count(&self) -> usize {
        self.runs.len()
    }

    /// Logarithm of the largest likelihood of the recordings times 2^(k/2) exp(-1/4 |ξ|²), nats; for weight 1.
    pub fn log_of_half_the_prior(&self) -> f64 {
        let sums = &self.sums;
        let gradient: Vec<f64> = (sums.gradient.iter().zip(&sums.first_gradient).zip(&self.xi))
            .map(|((all, first), xi)| all - first + 0.5 * xi)
            .collect();
        let Some((_, gain)) = newton(&sums.later_information, 0.5, &gradient) else { return f64::NAN };
        let factor = 0.5 * self.xi.len() as f64 * std::f64::consts::LN_2;
        sums.constant - 0.5 * (sums.squares + 0.5 * self.prior_squares() - gain) + factor
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

/// Linearises recordings with their initial states at the coordinates `xi` of the parameters.
fn linearised(e: &Explanation, xi: &[f64], opened: Vec<Opened>) -> Result<Vec<Run>, DesignError> {
    let values = e.values_at(xi);
    // As many recordings as are simulated in one pass; the results do not depend on it.
    let pass = |chunk: &[Opened]| -> Result<Vec<Run>, DesignError> {
        let starts: Vec<Vec<f64>> = chunk.iter().map(|(opened, u)| opened.1.at(u)).collect();
        let seeds: Vec<_> = chunk.iter().map(|(opened, _)| e.seeds(&opened.1)).collect();
        let task = |k: usize| Task {
            parameters: &values,
            record: &chunk[k].0.0,
            window: 0..chunk[k].0.0.times.len(),
            start: &starts[k],
            offsets: Offsets::None,
            seeds: &seeds[k],
        };
        let tasks: Vec<Task<'_>> = (0..chunk.len()).map(task).collect();
        let mut out = vec![Simulated::default(); tasks.len()];
        let results = e.system.simulate_batch(&tasks, &mut out);
        results.into_iter().collect::<Result<Vec<()>, _>>().map_err(|cause| e.failed(cause))?;
        let run = |((opened, u), out): (&Opened, &Simulated)| {
            let likelihood = likelihood(e, opened, (out, &values), xi.len(), u)?;
            Ok(Run { opened: opened.clone(), u: u.clone(), likelihood })
        };
        chunk.iter().zip(&out).map(run).collect()
    };
    let passes: Vec<Vec<Run>> =
        opened.par_chunks(e.system.simd_batch_size().max(1)).map(pass).collect::<Result<_, _>>()?;
    Ok(passes.into_iter().flatten().collect())
}

/// Linearises the likelihood of a recording, simulated with these parameter values and the coordinates `u` of the initial state.
fn likelihood(
    e: &Explanation,
    (record, start): &(Record, Start),
    (out, values): (&Simulated, &[f64]),
    parameters: usize,
    u: &[f64],
) -> Result<Likelihood, DesignError> {
    let channels = &e.system.schema().channels;
    let residual = |sample: usize, output: usize, _| {
        let measured = record.values[output].get(sample).copied().unwrap_or(f64::NAN);
        shortest_difference(measured - out.value(sample, output), channels[output].period)
    };
    let mut columns = e.columns((out, values), start, 1, residual);
    let intervals = e.intervals(record, values, out)?;
    let half_logs = whiten(&e.noise, &record.times, &mut columns, &intervals);
    let (rows, first_rows) = (columns.readings.len(), start_readings(e, &columns, start));
    let not_finite = || DesignError::NotFinite { name: e.name.clone(), record: record.id.clone() };
    let declared = declared_places(e, start);
    let all = Reduced::new(&columns, rows, parameters, u, &declared).ok_or_else(not_finite)?;
    let first = Reduced::new(&columns, first_rows, parameters, u, &declared).ok_or_else(not_finite)?;
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
