//! Forecasts of any simulated system after a prefix: its unknowns are estimated from the observed rows.
//!
//! Unknown are the initial state, the parameters of the single trajectory, and the offsets of its events.

use super::inference_problem::{InferenceProblem, Unknown};
use super::mode::Mode;
use super::posterior::posterior;
use super::prefix::{FilterSettings, Prefix, PrefixForecaster, add_measurement_noise};
use super::weights::resample;
use crate::{Samples, TrainerError};
use augsim_data::random_stream;
use augsim_system::{InitialValue, Parameter, Per, Prepare, Record, Scatter, ScatterPer, Seed, Simulated};
use std::sync::Arc;

/// Maximum number of events of a trajectory whose offset is estimated; later events have none.
const MAX_EVENT_OFFSETS: usize = 16;
/// Minimum standard deviation of a measurement, in the column's unit: files carry six digits.
const MIN_SD: f64 = 1e-6;
/// Number of measurements in excess of the unknowns that are needed to estimate the noise.
const MIN_SPARE_READINGS: usize = 8;

/// A forecaster that samples the posterior of a system's unknowns, given the observed first rows.
#[derive(Debug, Clone)]
pub struct SystemFilter {
    system: Arc<dyn Prepare>,
    /// Parameter values of the system for each trajectory, `[trajectory][parameter]`.
    parameters: Vec<Vec<f64>>,
    unknowns: Vec<Unknown>,
    has_shared_offset: bool,
    records: Vec<Record>,
    /// Learned standard deviation of the measurement noise of each channel; `None` before learning.
    noise: Option<Vec<f64>>,
}

impl SystemFilter {
    /// Creates a filter of the system with the parameter values of its model file.
    /// Estimated for each trajectory are its initial state, its per-trajectory parameters (with a prior at
    /// the declared value and the spread of their bounds), parameters with a 95 % interval, and event
    /// offsets where the model declares them random. Of `records`, one per trajectory, times, inputs and
    /// covariates are used; `groups` names the group of each trajectory, if it has one.
    pub fn new(system: Arc<dyn Prepare>, records: &[Record], groups: &[Option<&str>]) -> Self {
        let value = |p: &Parameter, group: Option<&str>| {
            let group_value = p.groups.iter().find(|(name, _)| Some(name.as_str()) == group);
            group_value.map_or(p.nominal, |(_, value)| *value)
        };
        let values = |group: &Option<&str>| system.parameters().iter().map(|p| value(p, *group)).collect();
        let mut filter = SystemFilter {
            parameters: groups.iter().map(values).collect(),
            unknowns: Vec::new(),
            has_shared_offset: false,
            records: records.iter().map(without_measurements).collect(),
            system,
            noise: None,
        };
        filter.collect_unknowns();
        filter
    }

    /// Makes parameter `index` differ from trajectory to trajectory with this standard deviation.
    #[must_use]
    pub fn with_random_parameter(mut self, index: usize, sd: f64) -> Self {
        let seed = Seed::Parameter(index);
        self.unknowns.retain(|u| u.seed != seed);
        let bounds = [f64::NEG_INFINITY, f64::INFINITY];
        self.unknowns.push(Unknown {
            seed,
            prior: Some((self.system.parameters()[index].nominal, sd)),
            bounds,
        });
        self
    }

    /// Sets learned priors, each a mean and a standard deviation ([`super::LearnedPriors::normal_priors`]).
    /// `noise` of each channel ([`super::LearnedPriors::noise`]) is used where neither the sensor nor the model file
    /// states it.
    #[must_use]
    pub fn with_normal_priors(mut self, laws: &[(Seed, f64, f64)], noise: &[f64]) -> Self {
        for (seed, mean, sd) in laws {
            if let Some(index) = self.unknowns.iter().position(|u| u.seed == *seed) {
                self.set_prior(index, (*mean, *sd));
            }
        }
        self.noise = Some(noise.to_vec());
        self
    }

    /// Indices of those unknowns that are parameters with a prior.
    pub(super) fn prior_indices(&self) -> Vec<usize> {
        let has_prior = |u: &Unknown| matches!(u.seed, Seed::Parameter(_)) && u.prior.is_some();
        (0..self.unknowns.len()).filter(|&i| has_prior(&self.unknowns[i])).collect()
    }

    /// Place in the simulation (parameter, initial state or event offset) of the unknown `index`.
    pub(super) fn seed(&self, index: usize) -> Seed {
        self.unknowns[index].seed
    }

    /// Mean and standard deviation of the prior of the unknown `index`; (0, infinity) for a flat prior.
    pub(super) fn prior(&self, index: usize) -> (f64, f64) {
        self.unknowns[index].prior.unwrap_or((0.0, f64::INFINITY))
    }

    /// Replaces the prior of the unknown `index` by a mean and a standard deviation.
    pub(super) fn set_prior(&mut self, index: usize, prior: (f64, f64)) {
        self.unknowns[index].prior = Some(prior);
    }

    /// Fits the unknowns to a whole prefix: `[mode, variance]` of those at `indices`, and noise of each channel.
    pub(super) fn fit_unknowns(
        &self,
        prefix: &Prefix<'_>,
        indices: &[usize],
    ) -> Result<(Vec<[f64; 2]>, Vec<f64>), TrainerError> {
        let (problem, mode) = self.find_mode(prefix, prefix.rows)?;
        let width = mode.values.len();
        let estimates = indices.iter().map(|&i| [mode.values[i], mode.covariance[i * width + i]]);
        Ok((estimates.collect(), problem.sd))
    }

    fn collect_unknowns(&mut self) {
        let schema = self.system.schema();
        let unbounded = [f64::NEG_INFINITY, f64::INFINITY];
        for (i, state) in schema.states.iter().enumerate() {
            let prior = match state.initial {
                InitialValue::Fixed(_) | InitialValue::FromRecord | InitialValue::PriorAboutRecord(_) => {
                    continue;
                }
                InitialValue::Prior(mean, sd) => Some((mean, sd)),
                InitialValue::Free | InitialValue::Measured(_) | InitialValue::PriorAboutExpression(_) => {
                    None
                }
            };
            self.unknowns.push(Unknown { seed: Seed::Start(i), prior, bounds: unbounded });
        }
        for (i, p) in self.system.parameters().iter().enumerate() {
            // Standard deviation of a uniform distribution between the bounds.
            let per_trajectory_sd = (p.per == Per::Trajectory).then_some((p.max - p.min) / 12_f64.sqrt());
            let Some(sd) =
                per_trajectory_sd.or(p.standard_deviation()).filter(|sd| sd.is_finite() && *sd > 0.0)
            else {
                continue;
            };
            let bounds = [p.min.min(p.nominal), p.max.max(p.nominal)];
            self.unknowns.push(Unknown { seed: Seed::Parameter(i), prior: Some((p.nominal, sd)), bounds });
        }
        if let Some(Scatter { per, sd, .. }) = schema.event.as_ref().and_then(|e| e.declared) {
            self.has_shared_offset = per == ScatterPer::Record;
            let prior = Some((0.0, sd));
            let offset_count = if self.has_shared_offset { 1 } else { MAX_EVENT_OFFSETS };
            let offsets =
                (0..offset_count).map(|k| Unknown { seed: Seed::Offset(k), prior, bounds: unbounded });
            self.unknowns.extend(offsets);
        }
    }
}

/// Copies a record without its measured values.
fn without_measurements(record: &Record) -> Record {
    let mut bare = record.clone();
    bare.values.iter_mut().for_each(|v| v.fill(f64::NAN));
    bare
}

impl SystemFilter {
    /// Finds the maximum a posteriori values of the unknowns given `rows`.
    /// Noise standard deviations that are not known are estimated from the residuals.
    fn find_mode<'a>(
        &'a self,
        prefix: &Prefix<'a>,
        rows: &'a [f64],
    ) -> Result<(InferenceProblem<'a>, Mode), TrainerError> {
        let schema = self.system.schema();
        let channels = schema.channels.len();
        let too_short = |needed: usize| TrainerError::UndeterminedStart {
            id: prefix.id.to_owned(),
            rows: rows.len() / channels,
            needed,
        };
        let noise_sd = |c: usize| {
            let stated = prefix.sensor.sd()[c].filter(|sd| *sd > 0.0);
            let learned = self.noise.as_ref().map(|noise| noise[c]);
            stated.or(schema.channels[c].sd.filter(|sd| *sd > 0.0)).or(learned)
        };
        let noise_sd: Vec<Option<f64>> = (0..channels).map(noise_sd).collect();
        let record = &self.records[prefix.index as usize];
        let (start, rough_noise) = self.rough_start(record, rows);
        let sd = noise_sd
            .iter()
            .zip(&rough_noise)
            .map(|(noise_sd, rough_noise)| noise_sd.unwrap_or(*rough_noise))
            .collect();
        let mut problem = InferenceProblem {
            system: &*self.system,
            unknowns: &self.unknowns,
            parameters: &self.parameters[prefix.index as usize],
            has_shared_offset: self.has_shared_offset,
            record,
            rows,
            sd,
            start,
        };
        let flat_unknowns = self.unknowns.iter().filter(|u| u.prior.is_none()).count();
        let spare = if noise_sd.iter().all(Option::is_some) { 0 } else { MIN_SPARE_READINGS };
        let readings = problem.measured_values(problem.observed_rows());
        if readings < flat_unknowns + spare {
            return Err(too_short(flat_unknowns + spare));
        }
        let mut mode = Mode::find(&problem).ok_or_else(|| too_short(flat_unknowns + spare))?;
        if spare > 0 {
            // The fit is repeated twice, because the estimated noise decides how strongly the priors pull.
            for _ in 0..2 {
                let freedom = readings as f64 / (readings - flat_unknowns) as f64;
                let rms = mode.rmse(&problem);
                for ((sd, noise_sd), rms) in problem.sd.iter_mut().zip(&noise_sd).zip(rms) {
                    *sd = noise_sd.unwrap_or(rms * freedom.sqrt()).max(MIN_SD);
                }
                mode = Mode::find(&problem).ok_or_else(|| too_short(flat_unknowns + spare))?;
            }
        }
        Ok((problem, mode))
    }

    /// Estimates a rough initial state and rough noise of each channel, from the observed rows alone.
    fn rough_start(&self, record: &Record, rows: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let schema = self.system.schema();
        let channels = schema.channels.len();
        let mut observed = record.clone();
        for (i, v) in rows.iter().enumerate() {
            observed.values[i % channels][i / channels] = *v;
        }
        let noise: Vec<f64> = observed.values.iter().map(|v| rough_noise(v)).collect();
        let mut uncut = observed.clone();
        uncut.use_as_one_window(schema);
        let is_start = |r: &Record| {
            r.windows.first().is_some_and(|w| w.samples.start == 0 && w.start.len() == schema.states.len())
        };
        let is_prepared = self.system.prepare(&mut observed, &noise).is_ok() && is_start(&observed);
        let record = if is_prepared { observed } else { uncut };
        let mut start = record.windows.into_iter().next().map_or_else(Vec::new, |w| w.start);
        start.resize(schema.states.len(), 0.0);
        start.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = 0.0);
        (start, noise)
    }
}

/// Estimates the noise of readings from the median absolute third difference, at least [`MIN_SD`].
/// For white noise of standard deviation s the third differences have standard deviation sqrt(20) s, and
/// the median of the absolute value of a normal variable is 0.674 standard deviations. With fewer than four
/// readings a third difference of 1e-3 is assumed.
fn rough_noise(values: &[f64]) -> f64 {
    let measured: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let mut third: Vec<f64> =
        measured.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).collect();
    third.sort_by(f64::total_cmp);
    let median = third.get(third.len() / 2).copied().unwrap_or(1e-3);
    (median / (0.674_489_75 * 20_f64.sqrt())).max(MIN_SD)
}

impl PrefixForecaster for SystemFilter {
    fn forecasts(
        &self,
        prefix: Prefix<'_>,
        lengths: &[usize],
        settings: FilterSettings,
    ) -> Result<Vec<Samples>, TrainerError> {
        let channels = self.system.schema().channels.len();
        let forecast_after = |&n: &usize| {
            let (problem, mode) = self.find_mode(&prefix, &prefix.rows[..n * channels])?;
            let mut rng = random_stream(settings.seed ^ n as u64, "filtered-system", prefix.index);
            let (particles, weights) = posterior(&problem, &mode, settings.particles, &mut rng);
            let chosen = resample(&weights, settings.samples, &mut rng);
            let (rows_ahead, count) = (prefix.time - n, settings.samples);
            let mut values = vec![0.0; rows_ahead * channels * count];
            let (mut simulated, mut simulated_particle) = (Simulated::default(), None);
            let width = self.unknowns.len();
            for (sample, &i) in chosen.iter().enumerate() {
                // Systematic resampling repeats a particle in consecutive samples, so its simulation is
                // reused.
                if simulated_particle != Some(i) {
                    let unknown_values = &particles[i * width..(i + 1) * width];
                    if !problem.simulate(unknown_values, prefix.time, &[], &mut simulated)
                        && !problem.simulate(&mode.values, prefix.time, &[], &mut simulated)
                    {
                        return Err(TrainerError::NotSimulated { id: prefix.id.to_owned() });
                    }
                    simulated_particle = Some(i);
                }
                for k in 0..rows_ahead {
                    for c in 0..channels {
                        values[(k * channels + c) * count + sample] = simulated.value(n + k, c) as f32;
                    }
                }
            }
            let mut samples = Samples { count, values };
            if settings.is_measured {
                let sd: Vec<Option<f64>> = problem.sd.iter().copied().map(Some).collect();
                add_measurement_noise(&mut samples, &sd, (settings.seed, prefix.index, n));
            }
            Ok(samples)
        };
        lengths.iter().map(forecast_after).collect()
    }
}
