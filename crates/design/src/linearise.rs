//! Linearisation of an explanation over a recording: residuals and their sensitivities, whitened.

use crate::error::DesignError;
use crate::explanation::{Explanation, factor_of};
use crate::whiten::{Columns, Interval, Reading};
use augsim_linear::Mat;
use augsim_system::{Offsets, Record, Seed, Simulated, SimulationError, Task};

/// Number of first samples that determine the initial state: as many as the rough initial state uses.
///
/// The evidence of a recording is that of its later samples, given these.
pub const START_SAMPLES: usize = 5;
/// Standard deviation of the prior of an estimated initial state, in units of its standard error from the record.
///
/// The prior has no influence: the evidence of the first samples, which determine the state, is divided out.
const BROAD_ERRORS: f64 = 100.0;
/// The same in units of the range of the state, for states that the outputs do not show.
const BROAD_RANGES: f64 = 10.0;

/// Initial state of a recording, with the standard deviations of its prior.
#[derive(Clone, Debug)]
pub(crate) struct Start {
    /// Prior mean of the declared states.
    pub mean: Vec<f64>,
    /// Standard deviation of the prior of each declared state; `None` where it is known.
    pub sd: Vec<Option<f64>>,
}

impl Start {
    /// Indices of the states that are estimated, with their standard deviations.
    pub fn unknown(&self) -> Vec<(usize, f64)> {
        self.sd.iter().enumerate().filter_map(|(i, sd)| Some((i, (*sd)?))).collect()
    }

    /// Initial state at the standard normal coordinates `u` of the estimated states.
    pub fn at(&self, u: &[f64]) -> Vec<f64> {
        let mut start = self.mean.clone();
        for ((state, sd), u) in self.unknown().into_iter().zip(u) {
            start[state] += sd * u;
        }
        start
    }
}

impl Explanation {
    /// Wraps an error of a simulation with the name of the explanation.
    pub(crate) fn failed(&self, cause: SimulationError) -> DesignError {
        DesignError::Simulation { name: self.name.clone(), cause }
    }

    /// Prepares a recording: see [`Explanation::prepared`].
    pub(crate) fn prepare(&self, record: &Record) -> Result<Record, DesignError> {
        self.prepared(record).map_err(|cause| DesignError::Objection { name: self.name.clone(), cause })
    }

    /// Prepares a recording, and the prior of its initial state about `planned` or else about the rough one.
    pub(crate) fn opened(
        &self,
        record: &Record,
        planned: Option<&[f64]>,
    ) -> Result<(Record, Start), DesignError> {
        let prepared = self.prepare(record)?;
        let rough = prepared.windows.first().map(|w| w.start.clone()).unwrap_or_default();
        let mean = planned.map_or(rough, <[f64]>::to_vec);
        let mut start = Start { sd: self.start_sd(mean.len(), 1.0), mean };
        let broad = self.broad_start_sd(&prepared, &start)?;
        start.sd = self
            .start_sd(start.mean.len(), 1.0)
            .into_iter()
            .zip(broad)
            .map(|(sd, broad)| sd.map(|sd| sd * broad))
            .collect();
        Ok((prepared, start))
    }

    /// Factor that makes the prior of each initial state broad; 1 for states with a declared prior.
    fn broad_start_sd(&self, record: &Record, start: &Start) -> Result<Vec<f64>, DesignError> {
        let seeds: Vec<Seed> = (0..start.mean.len()).map(Seed::Start).collect();
        let out = self.simulate(record, &self.values, &start.mean, &seeds)?;
        let broad = |state: usize| {
            if has_declared_prior(self, state) {
                return 1.0;
            }
            let mut information = 0.0;
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for k in 0..out.samples() {
                for (output, sensor) in self.noise.sensors.iter().enumerate() {
                    let sd = sensor.white_sd.hypot(sensor.autocorrelated_sd);
                    information += (out.slopes(k, output)[state] / sd).powi(2);
                }
                let value = out.value(k, self.outputs + state);
                (low, high) = (low.min(value), high.max(value));
            }
            let error = if information > 0.0 { BROAD_ERRORS / information.sqrt() } else { 0.0 };
            let sd = error.max(BROAD_RANGES * (high - low));
            if sd > 0.0 && sd.is_finite() { sd } else { 1.0 }
        };
        Ok((0..start.mean.len()).map(broad).collect())
    }

    /// Simulates a prepared recording with derivatives by `seeds`.
    pub(crate) fn simulate(
        &self,
        record: &Record,
        parameters: &[f64],
        start: &[f64],
        seeds: &[Seed],
    ) -> Result<Simulated, DesignError> {
        let window = 0..record.times.len();
        let task = Task { parameters, record, window, start, offsets: Offsets::None, seeds };
        let mut out = Simulated::default();
        self.system.simulate(&task, &mut out).map_err(|cause| self.failed(cause))?;
        Ok(out)
    }

    /// Simulates a prepared recording with several parameter values in one batch.
    pub(crate) fn simulate_draws(
        &self,
        record: &Record,
        draws: &[Vec<f64>],
        start: &[f64],
    ) -> Result<Vec<Simulated>, DesignError> {
        let window = 0..record.times.len();
        let task = |parameters| Task {
            parameters,
            record,
            window: window.clone(),
            start,
            offsets: Offsets::None,
            seeds: &[],
        };
        let tasks: Vec<Task<'_>> = draws.iter().map(|values| task(&values[..])).collect();
        let mut out = vec![Simulated::default(); tasks.len()];
        let results = self.system.simulate_batch(&tasks, &mut out);
        results.into_iter().collect::<Result<Vec<()>, _>>().map_err(|cause| self.failed(cause))?;
        Ok(out)
    }

    /// Seeds of the unknowns: uncertain parameters, then estimated initial states.
    pub(crate) fn seeds(&self, start: &Start) -> Vec<Seed> {
        let parameters = self.uncertain.iter().map(|i| Seed::Parameter(*i));
        parameters.chain(start.unknown().into_iter().map(|(state, _)| Seed::Start(state))).collect()
    }

    /// Columns of deviations of the readings: `targets`, then the sensitivities of `out` to the unknowns.
    ///
    /// `out` is simulated with the parameters `values`; `target(sample, output, column)` is the value of a target; a reading whose first target is not finite is left out.
    pub(crate) fn columns(
        &self,
        (out, values): (&Simulated, &[f64]),
        start: &Start,
        targets: usize,
        target: impl Fn(usize, usize, usize) -> f64,
    ) -> Columns {
        let (parameters, starts) = (self.uncertain.len(), start.unknown());
        let count = targets + parameters + starts.len();
        let readings = out.samples() * self.outputs;
        let mut columns = Columns {
            readings: Vec::with_capacity(readings),
            values: Vec::with_capacity(readings * count),
            count,
        };
        let by_coordinate = self.uncertain.iter().map(|index| self.slope_of_value(*index, values[*index]));
        let scales: Vec<f64> = by_coordinate.chain(starts.iter().map(|(_, sd)| *sd)).collect();
        let mut slopes = Vec::with_capacity(scales.len());
        for sample in 0..out.samples() {
            for output in 0..self.outputs {
                if !target(sample, output, 0).is_finite() {
                    continue;
                }
                columns.readings.push(Reading { sample, output });
                columns.values.extend((0..targets).map(|t| target(sample, output, t)));
                let by_value = out.slopes(sample, output);
                slopes.clear();
                slopes.extend(by_value.iter().zip(&scales).map(|(slope, scale)| slope * scale));
                // By the coordinates of the prior: the derivatives times its factor.
                let (by_parameter, by_start) = slopes.split_at(parameters);
                columns.values.extend((0..parameters).map(|j| {
                    by_parameter.iter().zip(&self.factor).map(|(slope, row)| slope * row[j]).sum::<f64>()
                }));
                columns.values.extend(by_start);
            }
        }
        columns
    }

    /// The explanation with its parameters at `xi` and the covariance L B L', with the block B of the parameters.
    pub(crate) fn after(&self, inverse: &Mat<f64>, xi: &[f64]) -> Self {
        let p = xi.len();
        let half = |row: &Vec<f64>| -> Vec<f64> {
            (0..p).map(|j| (0..p).map(|k| row[k] * inverse[(k, j)]).sum()).collect()
        };
        let entry = |row: &[f64], l: &Vec<f64>| row.iter().zip(l).map(|(a, b)| a * b).sum();
        let covariance: Vec<Vec<f64>> = (self.factor.iter().map(half))
            .map(|row| self.factor.iter().map(|l| entry(&row, l)).collect())
            .collect();
        Explanation { values: self.values_at(xi), factor: factor_of(&covariance), ..self.clone() }
    }

    /// Derivatives over each sample interval along a simulated path; empty without process noise.
    pub(crate) fn intervals(
        &self,
        record: &Record,
        parameters: &[f64],
        out: &Simulated,
    ) -> Result<Vec<Interval>, DesignError> {
        if self.noise.process.is_empty() {
            return Ok(Vec::new());
        }
        let states = self.system.schema().channels.len() - self.outputs;
        let seeds: Vec<Seed> = (0..states).map(Seed::Start).collect();
        let starts: Vec<Vec<f64>> = (0..out.samples())
            .map(|k| (0..states).map(|s| out.value(k, self.outputs + s)).collect())
            .collect();
        let task = |(k, start): (usize, &'_ Vec<f64>)| (k..(k + 2).min(record.times.len()), start.clone());
        let windows: Vec<_> = starts.iter().enumerate().map(task).collect();
        let tasks: Vec<Task<'_>> = windows
            .iter()
            .map(|(window, start)| Task {
                parameters,
                record,
                window: window.clone(),
                start,
                offsets: Offsets::None,
                seeds: &seeds,
            })
            .collect();
        let mut simulated = vec![Simulated::default(); tasks.len()];
        let results = self.system.simulate_batch(&tasks, &mut simulated);
        results.into_iter().collect::<Result<Vec<()>, _>>().map_err(|cause| self.failed(cause))?;
        let interval = |out: &Simulated| {
            let rows = |sample: usize, channels: std::ops::Range<usize>| -> Vec<f64> {
                channels.flat_map(|c| out.slopes(sample, c)[..states].to_vec()).collect()
            };
            Interval {
                output_by_state: rows(0, 0..self.outputs),
                next_by_state: if out.samples() > 1 {
                    rows(1, self.outputs..self.outputs + states)
                } else {
                    Vec::new()
                },
            }
        };
        Ok(simulated.iter().map(interval).collect())
    }
}

/// Number of readings within the first [`START_SAMPLES`] samples, if an initial state without a declared distribution
/// is estimated; otherwise 0.
pub(crate) fn start_readings(e: &Explanation, columns: &Columns, start: &Start) -> usize {
    if start.unknown().iter().all(|(state, _)| has_declared_prior(e, *state)) {
        return 0;
    }
    columns.readings.iter().take_while(|reading| reading.sample < START_SAMPLES).count()
}

/// Places of the states with a declared distribution among the initial states that are estimated.
pub(crate) fn declared_places(e: &Explanation, start: &Start) -> Vec<usize> {
    let unknown = start.unknown();
    let is_declared = |(_, (state, _)): &(usize, &(usize, f64))| has_declared_prior(e, *state);
    unknown.iter().enumerate().filter(is_declared).map(|(place, _)| place).collect()
}

/// Whether the model declares a distribution of the initial value of a state.
fn has_declared_prior(e: &Explanation, state: usize) -> bool {
    e.system.schema().states.get(state).is_some_and(|s| s.initial.prior_sd().is_some())
}
