//! Process noise versus measurement noise, by an iterated extended Kalman smoother.
//!
//! A simulation from an initial state assumes that the equations describe the motion exactly. Where they do
//! not, the residuals grow along the record. Three causes of the residuals are compared by their likelihood:
//!
//! 1. white measurement noise alone;
//! 2. in addition, autocorrelated measurement noise;
//! 3. in addition to white measurement noise, process noise in the rates of states.
//!
//! Process noise and autocorrelated measurement noise are Ornstein-Uhlenbeck processes, of which white noise
//! is the limit. The states come from an iterated extended Kalman smoother (Bell, SIAM Journal on
//! Optimization 4, 1994), the variances from the condition that the likelihood is at its maximum
//! (`variances.rs`), the correlation time from a grid.

use crate::linearise::{Disturbance, LinearisedInterval};
use crate::outcome::CalibrationError;
use crate::variances::{NoiseModel, NoiseProblem};
use augsim_system::{Record, Simulate};
use rayon::prelude::*;

/// Grid of correlation times of process noise or autocorrelated measurement noise, in sample steps.
///
/// White noise is tried in addition. The longest times far exceed most recordings: there, an autocorrelated
/// measurement error is an offset that differs from recording to recording.
const CORRELATION_TIMES: [f64; 10] = [2.0, 6.0, 20.0, 60.0, 200.0, 600.0, 2e3, 6e3, 2e4, 6e4];
/// Loss in ln likelihood up to which a shorter correlation time is preferred to the most likely one.
///
/// It is half the 95 % quantile of chi squared with one degree of freedom.
const MAX_LOSS_OF_SHORTER_TIME: f64 = 1.92;
/// Factors by which the best correlation time of the grid is multiplied and divided to refine it, one after
/// the other.
const REFINEMENT_FACTORS: [f64; 3] = [1.8, 1.35, 1.15];
/// Number of successive correlation times without a gain in likelihood after which the grid search stops.
const MAX_WORSE_TIMES: usize = 2;
/// Maximum number of samples, over all records, on which correlation times are compared.
const MAX_COMPARED_SAMPLES: usize = 6000;
/// Number of smoother iterations that lead from rough variances to the first path of the states.
const ROUGH_ITERATIONS: usize = 3;
/// Maximum number of smoother iterations in the fit of one noise model.
const MAX_ITERATIONS: usize = 8;
/// Gain in ln likelihood that each parameter of a noise model must bring for the model to be preferred.
const MIN_GAIN_PER_PARAMETER: f64 = 5.0;

/// Cause of a model's residuals: which kind of noise the noise model contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// White measurement noise only.
    Sensor,
    /// White measurement noise plus autocorrelated measurement noise.
    AutocorrelatedSensor,
    /// White measurement noise plus process noise in the rates of states.
    ProcessNoise,
}

/// Smoothed states of records, with the process noise and measurement noise estimated from them.
#[derive(Clone, Debug)]
pub struct Smoothed {
    /// Noise model that the data support best: the kind of noise that causes the residuals.
    pub cause: Cause,
    /// Standard deviation of each disturbance in the noise model; empty for [`Cause::Sensor`].
    ///
    /// For [`Cause::ProcessNoise`] there is one for each disturbed state, in the unit of its rate, averaged over a
    /// sample step; for [`Cause::AutocorrelatedSensor`] one for each channel, in its unit.
    pub disturbance_sd: Vec<f64>,
    /// Time in which the autocorrelation of the process noise or measurement error falls to 1/e, s; 0 for
    /// white noise.
    pub correlation_time_s: f64,
    /// Standard deviation of the white measurement noise of each channel, in its unit.
    pub sensor_sd: Vec<f64>,
    /// Ln likelihood of the readings under each noise model, in the order of [`Cause`].
    ///
    /// Minus infinity for a noise model under which no simulated motion is near the readings.
    pub ln_likelihood: [f64; 3],
    /// Smoothed states of each record, `[record][sample][state]`, flat for each record.
    pub paths: Vec<Vec<f64>>,
}

/// Fitted noise model for one cause of the residuals, with the smoothed states under it.
struct FittedCause {
    noise_model: NoiseModel,
    paths: Vec<Vec<f64>>,
    /// Ln likelihood minus the gain required of the noise model's parameters.
    score: f64,
    /// Whether the smoother iterations have converged to `paths`.
    has_converged: bool,
}

/// Estimates states, process noise and measurement noise of prepared records at fixed parameter values.
///
/// The channels of `system` are its `outputs` outputs followed by its states. Process noise acts on the rates
/// of `disturbed_states`. `known_sensor_sd` holds the known standard deviations of the measurement noise, by
/// output; `None` where it is estimated.
///
/// # Errors
/// [`CalibrationError`]: nothing was measured, or an interval cannot be simulated.
pub fn smooth(
    system: &dyn Simulate,
    outputs: usize,
    records: &[Record],
    values: &[f64],
    disturbed_states: &[usize],
    known_sensor_sd: &[Option<f64>],
) -> Result<Smoothed, CalibrationError> {
    let problem = NoiseProblem::new(system, outputs, records, values, disturbed_states, known_sensor_sd)?;
    // With process noise the motion can follow any readings, so this cause always has a path; the other
    // causes need undisturbed motions of the model near the readings.
    let mut best = problem.fit_process_noise(values)?;
    let mut cause = Cause::ProcessNoise;
    let mut ln_likelihood = [f64::NEG_INFINITY, f64::NEG_INFINITY, best.noise_model.ln_likelihood];
    let runs = problem.simulate_records(values).unwrap_or_default();
    let readings: Vec<Disturbance> = (0..outputs).map(Disturbance::Reading).collect();
    let others = [(Cause::AutocorrelatedSensor, readings, 1), (Cause::Sensor, Vec::new(), 0)];
    let process_paths = best.paths.clone();
    for (other, disturbances, index) in others.into_iter().filter(|_| !runs.is_empty()) {
        let fitted = problem.fit_cause(values, disturbances, runs.clone()).ok().filter(|f| f.has_converged);
        let fitted = match other {
            Cause::Sensor => fitted.or_else(|| problem.fit_sensor_along(values, [&runs, &process_paths])),
            _ => fitted,
        };
        let Some(fitted) = fitted else { continue };
        ln_likelihood[index] = fitted.noise_model.ln_likelihood;
        if fitted.score >= best.score || best.score.is_nan() {
            (cause, best) = (other, fitted);
        }
    }
    let FittedCause { noise_model, paths, .. } = best;
    Ok(Smoothed {
        cause,
        disturbance_sd: problem.disturbance_variances(&noise_model).iter().map(|v| v.sqrt()).collect(),
        correlation_time_s: noise_model.correlation_steps * problem.min_step_s(),
        sensor_sd: noise_model.noise.sensor.iter().map(|v| v.sqrt()).collect(),
        ln_likelihood,
        paths,
    })
}

impl NoiseProblem<'_> {
    /// Fits the noise model with process noise; its first paths are smoothed with rough variances.
    fn fit_process_noise(&self, values: &[f64]) -> Result<FittedCause, CalibrationError> {
        let rough_path = |record| self.rough_path(record, values);
        let paths: Result<Vec<Vec<f64>>, _> = self.records.par_iter().map(rough_path).collect();
        let mut paths = paths.map_err(CalibrationError::Simulation)?;
        let rough = self.rough_noise_model(self.rate_disturbances(), 0.0);
        self.iterate_smoother(rough, values, &mut paths, ROUGH_ITERATIONS)?;
        self.fit_cause(values, self.rate_disturbances(), paths)
    }

    /// Fits white measurement noise alone along each of these paths of all records, and returns the most likely result; `None`
    /// if none has a finite likelihood.
    ///
    /// Where a rate nearly jumps (dry friction), the smoother for this cause may not converge. Without it the cause would be
    /// process noise, even of a standard deviation near 0.
    fn fit_sensor_along(&self, values: &[f64], candidates: [&Vec<Vec<f64>>; 2]) -> Option<FittedCause> {
        let samples: Vec<usize> = self.records.iter().map(|r| r.times.len()).collect();
        let along = |paths: &Vec<Vec<f64>>| {
            let intervals = self.linearise(values, paths).ok()?;
            let rough = self.rough_noise_model(Vec::new(), 0.0);
            let noise_model = self.estimate_variances(rough, paths, &intervals, &samples).0;
            let score = noise_model.ln_likelihood;
            Some(FittedCause { noise_model, paths: paths.clone(), score, has_converged: true })
        };
        let fitted = candidates.into_iter().filter_map(along).filter(|fitted| fitted.score.is_finite());
        fitted.max_by(|a, b| a.score.total_cmp(&b.score))
    }

    /// Fits the noise model with these disturbances, starting from the state paths `paths`.
    ///
    /// The path of one cause is no starting path for another: through an event of the model, a path with
    /// process noise may differ from every undisturbed motion.
    fn fit_cause(
        &self,
        values: &[f64],
        disturbances: Vec<Disturbance>,
        mut paths: Vec<Vec<f64>>,
    ) -> Result<FittedCause, CalibrationError> {
        let intervals = self.linearise(values, &paths)?;
        let start = select_correlation_time(self, &disturbances, &paths, &intervals);
        let (noise_model, has_converged) =
            self.iterate_smoother(start, values, &mut paths, MAX_ITERATIONS)?;
        let correlation_times = if noise_model.correlation_steps > 0.0 { 1.0 } else { 0.0 };
        let parameters = noise_model.disturbances.len() as f64 + correlation_times;
        let score = noise_model.ln_likelihood - MIN_GAIN_PER_PARAMETER * parameters;
        Ok(FittedCause { noise_model, paths, score, has_converged })
    }
}

/// Selects the shortest correlation time that the data do not reject, along fixed paths; returns its noise
/// model.
///
/// Beyond the length of a recording the likelihood hardly depends on the correlation time, and a needlessly long one would let forecasts
/// drift further than any recording did.
///
/// Every correlation time starts from rough variances: a variance that is almost 0 under one correlation time
/// would hardly grow again under the next.
fn select_correlation_time(
    problem: &NoiseProblem<'_>,
    disturbances: &[Disturbance],
    paths: &[Vec<f64>],
    intervals: &[Vec<LinearisedInterval>],
) -> NoiseModel {
    let samples = compared_samples(problem.records);
    let fit_with = |steps: f64| {
        let rough = problem.rough_noise_model(disturbances.to_vec(), steps);
        problem.estimate_variances(rough, paths, intervals, &samples).0
    };
    // Of process noise that lasts longer than a recording only the rate of change shows in the data, not the size: forecasts would begin with
    // forces that no recording had. Errors of a sensor differ from recording to recording, which shows their size.
    let longest = problem.records.iter().map(|r| r.times.len()).max().unwrap_or(0) as f64;
    let is_of_sensor = disturbances.iter().all(|d| matches!(d, Disturbance::Reading(_)));
    let is_possible = |steps: f64| is_of_sensor || steps <= longest;
    let mut fitted = vec![fit_with(0.0)];
    let mut highest = fitted[0].ln_likelihood;
    let mut worse = 0;
    let times = CORRELATION_TIMES.iter().filter(|steps| is_possible(**steps));
    for steps in times.filter(|_| !disturbances.is_empty()) {
        let model = fit_with(*steps);
        worse = if model.ln_likelihood > highest { 0 } else { worse + 1 };
        highest = highest.max(model.ln_likelihood);
        fitted.push(model);
        if worse == MAX_WORSE_TIMES {
            break;
        }
    }
    let is_as_good = |model: &NoiseModel| model.ln_likelihood >= highest - MAX_LOSS_OF_SHORTER_TIME;
    let shortest = fitted.iter().position(is_as_good).unwrap_or(0);
    let mut best = fitted.swap_remove(shortest);
    let is_correlated = best.correlation_steps > 0.0;
    for factor in REFINEMENT_FACTORS.iter().filter(|_| is_correlated) {
        let refined = [best.correlation_steps / factor, best.correlation_steps * factor];
        for steps in refined.into_iter().filter(|steps| is_possible(*steps)) {
            let fitted = fit_with(steps);
            if fitted.ln_likelihood > best.ln_likelihood {
                best = fitted;
            }
        }
    }
    best
}

/// Number of first samples of each record on which correlation times are compared.
fn compared_samples(records: &[Record]) -> Vec<usize> {
    let mut remaining = MAX_COMPARED_SAMPLES;
    let take = |record: &Record| {
        let samples = record.times.len().min(remaining);
        remaining -= samples;
        samples
    };
    records.iter().map(take).collect()
}
