//! Maximum-likelihood variances of process and measurement noise, along paths of the states.
//!
//! The variance v of a noise is iterated with the sums (9) of `kalman.rs`, which are equal at the maximum of
//! the likelihood:
//!
//! ```text
//! (1)  v <- v (observed sum) / (expected sum)
//! ```
//!
//! A disturbance with the correlation φ from sample to sample and the stationary variance v has v as its
//! initial variance and q = (1 - φ²) v as its process noise, so both enter the sums of v.

use crate::kalman::{Filter, Noise, Sample, Smoothing, VarianceBalance, diagonal, smooth_record};
use crate::linearise::{Disturbance, Layout, LinearisedInterval, SystemWithStates};
use crate::outcome::CalibrationError;
use crate::starts::estimate_initial_state;
use augsim_system::{InitialValue, Offsets, Record, Simulate, Simulated, SimulationError, Task, channel_sd};
use rayon::prelude::*;

/// Maximum number of iterations in the estimation of the variances.
const MAX_VARIANCE_ITERATIONS: usize = 30;
/// Change of the logarithm of every variance below which their iteration has converged.
const VARIANCE_TOLERANCE: f64 = 0.01;
/// Maximum factor by which a variance changes in one iteration, upwards or downwards.
const MAX_VARIANCE_FACTOR: f64 = 30.0;
/// Largest change of a smoothed path, relative to the RMS of its states, below which the smoother stops.
const PATH_TOLERANCE: f64 = 1e-4;
/// Largest change of a smoothed path, relative to the RMS of its states, for which it counts as converged.
const MAX_ACCEPTED_PATH_CHANGE: f64 = 1e-2;
/// Initial standard deviation of process noise, as a share of the RMS of the rate that it is added to.
const ROUGH_PROCESS_NOISE: f64 = 0.1;

/// Estimation of measurement noise and process noise of a system from records.
pub(crate) struct NoiseProblem<'a> {
    system: SystemWithStates<'a>,
    pub records: &'a [Record],
    /// Indices of the states whose rates have process noise, in noise models that contain process noise.
    disturbed_states: &'a [usize],
    /// Known standard deviations of the measurement noise, by channel, in its unit; `None` where it is
    /// estimated.
    known_sensor_sd: &'a [Option<f64>],
    /// Root mean square of each state over simulations of the records, in the unit of the state.
    state_rms: Vec<f64>,
    /// Root mean square of the rate of each state over simulations of the records, in its unit per second.
    rate_rms: Vec<f64>,
}

/// Noise model: disturbances with variances and correlation time, and variances of the measurement noise.
#[derive(Clone, Debug)]
pub(crate) struct NoiseModel {
    pub disturbances: Vec<Disturbance>,
    /// Correlation time of the disturbances, in sample steps; 0 for white noise.
    pub correlation_steps: f64,
    pub noise: Noise,
    pub ln_likelihood: f64,
}

impl NoiseModel {
    /// Autocorrelation of a disturbance from one sample to the next.
    fn correlation(&self) -> f64 {
        if self.correlation_steps > 0.0 { (-1.0 / self.correlation_steps).exp() } else { 0.0 }
    }
}

impl<'a> NoiseProblem<'a> {
    /// Collects the records and computes the root mean squares of the states and their rates.
    ///
    /// # Errors
    /// [`CalibrationError::NothingMeasured`].
    pub fn new(
        system: &'a dyn Simulate,
        outputs: usize,
        records: &'a [Record],
        values: &[f64],
        disturbed_states: &'a [usize],
        known_sensor_sd: &'a [Option<f64>],
    ) -> Result<Self, CalibrationError> {
        if !records.iter().any(|r| r.values.iter().take(outputs).flatten().any(|v| v.is_finite())) {
            return Err(CalibrationError::NothingMeasured);
        }
        let states = system.schema().states.len();
        let mut problem = Self {
            system: SystemWithStates { system, outputs, states },
            records,
            disturbed_states,
            known_sensor_sd,
            state_rms: vec![1.0; states],
            rate_rms: vec![1.0; states],
        };
        problem.set_magnitudes(values);
        Ok(problem)
    }

    /// Computes the root mean squares of states and rates by simulating the windows of the records.
    fn set_magnitudes(&mut self, values: &[f64]) {
        let n = self.system.states;
        let (mut squares, mut rates, mut count) = (vec![0.0; n], vec![0.0; n], 0.0_f64);
        let windows = self.records.iter().flat_map(|r| r.windows.iter().map(move |w| (r, w)));
        for (record, window) in windows {
            let task = Task {
                parameters: values,
                record,
                window: window.samples.clone(),
                start: &self.complete_start(&window.start),
                offsets: Offsets::None,
                seeds: &[],
            };
            let mut out = Simulated::default();
            if self.system.system.simulate(&task, &mut out).is_err() {
                continue;
            }
            for k in 1..out.samples() {
                let dt = record.times[window.samples.start + k] - record.times[window.samples.start + k - 1];
                let state = |k: usize, i: usize| out.value(k, self.system.outputs + i);
                if (0..n).all(|i| state(k, i).is_finite() && state(k - 1, i).is_finite()) {
                    count += 1.0;
                    for i in 0..n {
                        squares[i] += state(k, i).powi(2);
                        rates[i] += ((state(k, i) - state(k - 1, i)) / dt).powi(2);
                    }
                }
            }
        }
        let rms = |sum: f64| {
            Some((sum / count.max(1.0)).sqrt()).filter(|s| s.is_finite() && *s > 0.0).unwrap_or(1.0)
        };
        self.state_rms = squares.into_iter().map(rms).collect();
        self.rate_rms = rates.into_iter().map(rms).collect();
    }

    /// Appends the initial values of states that effects added to the model to the initial state of a window.
    fn complete_start(&self, start: &[f64]) -> Vec<f64> {
        let states = &self.system.system.schema().states;
        let added = states.iter().skip(start.len()).map(|state| match state.initial {
            InitialValue::Fixed(value) | InitialValue::Prior(value, _) => value,
            InitialValue::FromRecord | InitialValue::PriorAboutRecord(_) => f64::NAN,
            InitialValue::Free | InitialValue::Measured(_) | InitialValue::PriorAboutExpression(_) => 0.0,
        });
        start.iter().copied().chain(added).collect()
    }

    /// Disturbances of a model with process noise: one in the rate of each disturbed state.
    pub fn rate_disturbances(&self) -> Vec<Disturbance> {
        self.disturbed_states.iter().map(|s| Disturbance::Rate(*s)).collect()
    }

    /// Typical sample step of the record that is sampled fastest, s.
    pub fn min_step_s(&self) -> f64 {
        self.records.iter().map(Record::typical_step).fold(f64::INFINITY, f64::min)
    }

    /// Creates a noise model with rough variances, from which their estimation starts.
    pub fn rough_noise_model(&self, disturbances: Vec<Disturbance>, correlation_steps: f64) -> NoiseModel {
        let schema = self.system.system.schema();
        let initial = schema.states.iter().zip(&self.state_rms).map(|(state, rms)| match state.initial {
            InitialValue::Free | InitialValue::Measured(_) => rms * rms,
            known => known.prior_sd().map_or(0.0, |sd| sd * sd),
        });
        let initial: Vec<f64> = initial.collect();
        let sensor_variance = |channel: usize| {
            let known = self.known_sensor_sd(channel);
            let sd = known.unwrap_or_else(|| rough_sensor_sd(self.records, channel));
            (sd * sd).max(f64::MIN_POSITIVE)
        };
        let sensor = (0..self.system.outputs).map(sensor_variance).collect();
        let variances: Vec<f64> = disturbances
            .iter()
            .map(|disturbance| match disturbance {
                Disturbance::Rate(state) => (ROUGH_PROCESS_NOISE * self.rate_rms[*state]).powi(2),
                Disturbance::Reading(channel) => sensor_variance(*channel),
            })
            .collect();
        let noise = Noise { initial, process: vec![0.0; self.system.states], sensor };
        let ln_likelihood = f64::NEG_INFINITY;
        let mut model = NoiseModel { disturbances, correlation_steps, noise, ln_likelihood };
        self.set_disturbance_variances(&mut model, &variances);
        model
    }

    /// Known standard deviation of the measurement noise of a channel, in its unit; `None` where it is
    /// estimated.
    fn known_sensor_sd(&self, channel: usize) -> Option<f64> {
        self.known_sensor_sd.get(channel).copied().flatten()
    }

    /// Stationary variances of the disturbances of a noise model, in the order of the disturbances.
    pub fn disturbance_variances<'m>(&self, model: &'m NoiseModel) -> &'m [f64] {
        &model.noise.initial[self.system.states..]
    }

    /// Sets the stationary variances of the disturbances and the process noise (1 - φ²) v that maintains
    /// them.
    fn set_disturbance_variances(&self, model: &mut NoiseModel, variances: &[f64]) {
        let n = self.system.states;
        let innovation_share = 1.0 - model.correlation().powi(2);
        model.noise.initial.truncate(n);
        model.noise.initial.extend(variances);
        model.noise.process = vec![0.0; n];
        model.noise.process.extend(variances.iter().map(|v| v * innovation_share));
    }

    /// Estimates a path of the N states through the readings, `[sample][N]`, by an extended Kalman filter.
    pub fn rough_path(&self, record: &Record, values: &[f64]) -> Result<Vec<f64>, SimulationError> {
        let n = self.system.states;
        let model = self.rough_noise_model(self.rate_disturbances(), 0.0);
        let layout = Layout { system: self.system, disturbances: &model.disturbances, correlation: 0.0 };
        let mut state = self.rough_start(record);
        let d = layout.size();
        let mut covariance = diagonal(&model.noise.initial);
        let mut path = Vec::with_capacity(record.times.len() * n);
        for k in 0..record.times.len() {
            let mut filter = Filter::new(covariance, vec![0.0; d]);
            let predicted = self.system.linearise_at(record, values, k, &state)?;
            for reading in layout.readings(record, k, &predicted) {
                filter.update(&reading, model.noise.sensor[reading.channel]);
            }
            state.iter_mut().zip(&filter.mean).for_each(|(s, m)| *s += m);
            path.extend(&state);
            if k + 1 == record.times.len() {
                break;
            }
            let updated = self.system.linearise_at(record, values, k, &state)?;
            let transition = layout.transition(&updated, record.times[k + 1] - record.times[k]);
            let offset = vec![0.0; d];
            filter.predict(&Sample { offset, transition, readings: Vec::new() }, &model.noise.process);
            state = updated.next_state;
            covariance = filter.covariance;
        }
        Ok(path)
    }

    /// Rough initial state of a record: that of its first window.
    fn rough_start(&self, record: &Record) -> Vec<f64> {
        let mut start =
            self.complete_start(&record.windows.first().map(|w| w.start.clone()).unwrap_or_default());
        let of_effects = self.system.system.effect_starts(record, 0, &start);
        let first = start.len().saturating_sub(of_effects.len());
        start[first..]
            .iter_mut()
            .zip(of_effects)
            .filter(|(x, _)| x.is_nan())
            .for_each(|(x, known)| *x = known);
        start
    }

    /// Simulates each record without process noise, `[sample][N]`, from the initial state that fits the whole
    /// record best.
    pub fn simulate_records(&self, values: &[f64]) -> Result<Vec<Vec<f64>>, CalibrationError> {
        let simulate = |record: &Record| {
            let rough = self.rough_start(record);
            // The channels of the states have no measured values.
            let mut record = record.clone();
            record.values.truncate(self.system.outputs);
            record.values.extend(vec![vec![f64::NAN; record.times.len()]; self.system.states]);
            let samples = record.times.len();
            let fitted = estimate_initial_state(
                self.system.system,
                &record,
                samples,
                values,
                &rough,
                self.known_sensor_sd,
            )?;
            let task = Task {
                parameters: values,
                record: &record,
                window: 0..samples,
                start: &fitted.state,
                offsets: Offsets::None,
                seeds: &[],
            };
            let mut out = Simulated::default();
            self.system.system.simulate(&task, &mut out).map_err(CalibrationError::Simulation)?;
            let states = |k: usize| (0..self.system.states).map(move |i| (k, self.system.outputs + i));
            Ok((0..samples).flat_map(states).map(|(k, channel)| out.value(k, channel)).collect())
        };
        self.records.par_iter().map(simulate).collect()
    }

    /// Linearises the sample intervals of every record along the record's path.
    pub fn linearise(
        &self,
        values: &[f64],
        paths: &[Vec<f64>],
    ) -> Result<Vec<Vec<LinearisedInterval>>, CalibrationError> {
        let linearise =
            |(record, path): (&Record, &Vec<f64>)| self.system.linearise_path(record, values, path);
        let intervals = self.records.iter().zip(paths).map(linearise).collect::<Result<_, _>>();
        intervals.map_err(CalibrationError::Simulation)
    }

    /// Estimates the variances of a noise model along fixed paths; also returns the smoothed records.
    ///
    /// `samples` holds, for each record, how many of its first samples are used; records with fewer than 2
    /// are skipped.
    pub fn estimate_variances(
        &self,
        mut model: NoiseModel,
        paths: &[Vec<f64>],
        intervals: &[Vec<LinearisedInterval>],
        samples: &[usize],
    ) -> (NoiseModel, Vec<Smoothing>) {
        let (disturbances, correlation) = (model.disturbances.clone(), model.correlation());
        let layout = Layout { system: self.system, disturbances: &disturbances, correlation };
        let lists: Vec<Vec<Sample>> = (self.records.par_iter().zip(paths).zip(intervals).zip(samples))
            .filter(|(_, count)| **count > 1)
            .map(|(((record, path), intervals), count)| layout.samples(record, path, &intervals[..*count]))
            .collect();
        let mut smoothings: Vec<Smoothing> = Vec::new();
        for _ in 0..MAX_VARIANCE_ITERATIONS {
            smoothings = lists.par_iter().map(|list| smooth_record(list, &model.noise)).collect();
            model.ln_likelihood = smoothings.iter().map(|s| s.ln_likelihood).sum();
            if self.update_variances(&mut model, &smoothings) < VARIANCE_TOLERANCE {
                break;
            }
        }
        (model, smoothings)
    }

    /// Updates every unknown variance once by iteration (1); returns the largest absolute change of a
    /// logarithm.
    fn update_variances(&self, model: &mut NoiseModel, smoothings: &[Smoothing]) -> f64 {
        let n = self.system.states;
        let mut largest = 0.0_f64;
        let mut ratio = |balance: VarianceBalance| {
            let ratio = balance.observed / balance.expected;
            let ratio = ratio.clamp(1.0 / MAX_VARIANCE_FACTOR, MAX_VARIANCE_FACTOR);
            let ratio = if ratio.is_finite() { ratio } else { 1.0 };
            largest = largest.max(ratio.ln().abs());
            ratio
        };
        let innovation_share = 1.0 - model.correlation().powi(2);
        let variances: Vec<f64> = (n..n + model.disturbances.len())
            .map(|i| {
                let sum = smoothings.iter().fold(VarianceBalance::default(), |sum, s| {
                    let (initial, process) = (s.initial[i], s.process[i]);
                    VarianceBalance {
                        observed: sum.observed + initial.observed + innovation_share * process.observed,
                        expected: sum.expected + initial.expected + innovation_share * process.expected,
                    }
                });
                model.noise.initial[i] * ratio(sum)
            })
            .collect();
        for channel in 0..self.system.outputs {
            if self.known_sensor_sd(channel).is_some() {
                continue;
            }
            let sum = smoothings.iter().fold(VarianceBalance::default(), |sum, s| VarianceBalance {
                observed: sum.observed + s.sensor[channel].observed,
                expected: sum.expected + s.sensor[channel].expected,
            });
            model.noise.sensor[channel] *= ratio(sum);
        }
        self.set_disturbance_variances(model, &variances);
        largest
    }

    /// Iterates the smoother: each pass linearises along the last smoothed paths and estimates the variances
    /// again.
    ///
    /// Returns the noise model, and whether the last pass changed the paths by less than
    /// [`MAX_ACCEPTED_PATH_CHANGE`].
    pub fn iterate_smoother(
        &self,
        mut model: NoiseModel,
        values: &[f64],
        paths: &mut [Vec<f64>],
        max_iterations: usize,
    ) -> Result<(NoiseModel, bool), CalibrationError> {
        let samples: Vec<usize> = self.records.iter().map(|r| r.times.len()).collect();
        let n = self.system.states;
        let d = n + model.disturbances.len();
        let mut largest_change = f64::INFINITY;
        for _ in 0..max_iterations {
            let intervals = self.linearise(values, paths)?;
            let smoothings;
            (model, smoothings) = self.estimate_variances(model, paths, &intervals, &samples);
            largest_change = 0.0;
            for (path, smoothing) in paths.iter_mut().zip(&smoothings) {
                for (point, deviation) in
                    path.chunks_exact_mut(n.max(1)).zip(smoothing.deviations.chunks_exact(d.max(1)))
                {
                    for ((x, by), rms) in point.iter_mut().zip(deviation).zip(&self.state_rms) {
                        *x += by;
                        largest_change = largest_change.max(by.abs() / rms);
                    }
                }
            }
            if largest_change < PATH_TOLERANCE {
                break;
            }
        }
        Ok((model, largest_change < MAX_ACCEPTED_PATH_CHANGE))
    }
}

/// Rough standard deviation of the measurement noise of a channel, in its unit, from third differences.
///
/// The third differences of a smooth motion are small against those of the noise.
fn rough_sensor_sd(records: &[Record], channel: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for record in records {
        let Some(values) = record.values.get(channel) else { continue };
        for w in values.windows(4) {
            let third = w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0];
            if third.is_finite() {
                sum += third * third;
                count += 1.0;
            }
        }
    }
    // The third difference of white noise has 1² + 3² + 3² + 1² = 20 times its variance.
    let sd = (sum / (20.0 * count.max(1.0))).sqrt();
    sd.max(1e-9 * channel_sd(records, channel))
}
