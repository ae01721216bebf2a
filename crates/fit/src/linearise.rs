//! Linearisation of a system along a path of its states, one sample interval at a time.

use crate::kalman::{Reading, Sample};
use augsim_system::{Channel, Offsets, Record, Seed, Simulate, Simulated, SimulationError, Task};
use rayon::prelude::*;

/// Number of SIMD batches of sample intervals in one parallel task.
const BATCHES_PER_TASK: usize = 16;

/// A system whose simulated channels are its measured outputs followed by its states.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SystemWithStates<'a> {
    pub system: &'a dyn Simulate,
    /// Number of outputs, the channels that have sensors.
    pub outputs: usize,
    /// Number of states, the channels after the outputs.
    pub states: usize,
}

/// Simulation of one sample interval, linearised about the state at its start. Matrices are stored by rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct LinearisedInterval {
    /// Simulated state at the next sample, `[N]` with N states; empty at the last sample.
    pub next_state: Vec<f64>,
    /// Derivatives of the next state with respect to the state at the start of the interval, `[N][N]`.
    pub next_by_state: Vec<f64>,
    /// Simulated outputs at the start of the interval, `[C]` with C outputs.
    pub outputs: Vec<f64>,
    /// Derivatives of the outputs with respect to the state at the start of the interval, `[C][N]`.
    pub output_by_state: Vec<f64>,
}

impl<'a> SystemWithStates<'a> {
    /// Linearises every sample interval of a record along a path of the N states, `[sample][N]`.
    ///
    /// # Errors
    /// The first interval that cannot be simulated.
    pub fn linearise_path(
        &self,
        record: &Record,
        values: &[f64],
        path: &[f64],
    ) -> Result<Vec<LinearisedInterval>, SimulationError> {
        let seeds = self.state_seeds();
        let samples: Vec<usize> = (0..record.times.len()).collect();
        let per_task = BATCHES_PER_TASK * self.system.simd_batch_size().max(1);
        let linearise = |samples: &[usize]| -> Vec<Result<LinearisedInterval, SimulationError>> {
            let task = |k: &usize| {
                self.task(record, values, *k, &path[k * self.states..(k + 1) * self.states], &seeds)
            };
            let tasks: Vec<Task<'_>> = samples.iter().map(task).collect();
            let mut simulated = vec![Simulated::default(); tasks.len()];
            let results = self.system.simulate_batch(&tasks, &mut simulated).into_iter();
            results.zip(&simulated).map(|(result, out)| result.map(|()| self.interval(out))).collect()
        };
        samples.par_chunks(per_task).flat_map_iter(linearise).collect()
    }

    /// Linearises the sample interval after sample `k` about `state`, its state at that sample.
    ///
    /// # Errors
    /// The interval cannot be simulated.
    pub fn linearise_at(
        &self,
        record: &Record,
        values: &[f64],
        k: usize,
        state: &[f64],
    ) -> Result<LinearisedInterval, SimulationError> {
        let seeds = self.state_seeds();
        let mut out = Simulated::default();
        self.system.simulate(&self.task(record, values, k, state, &seeds), &mut out)?;
        Ok(self.interval(&out))
    }

    /// Seeds for derivatives with respect to each state at the start of an interval.
    fn state_seeds(&self) -> Vec<Seed> {
        (0..self.states).map(Seed::Start).collect()
    }

    fn task<'t>(
        &self,
        record: &'t Record,
        parameters: &'t [f64],
        k: usize,
        start: &'t [f64],
        seeds: &'t [Seed],
    ) -> Task<'t> {
        let window = k..(k + 2).min(record.times.len());
        Task { parameters, record, window, start, offsets: Offsets::None, seeds }
    }

    fn interval(&self, out: &Simulated) -> LinearisedInterval {
        let (n, c) = (self.states, self.outputs);
        let mut interval = LinearisedInterval::default();
        for channel in 0..c {
            interval.outputs.push(out.value(0, channel));
            interval.output_by_state.extend(&out.slopes(0, channel)[..n]);
        }
        if out.samples() > 1 {
            for state in 0..n {
                interval.next_state.push(out.value(1, c + state));
                interval.next_by_state.extend(&out.slopes(1, c + state)[..n]);
            }
        }
        interval
    }

    /// Measured minus predicted value at sample `k`, by channel; `None` where nothing was measured.
    fn residuals(&self, record: &Record, k: usize, outputs: &[f64]) -> Vec<Option<f64>> {
        let channels = self.system.schema().channels.iter().zip(&record.values).take(self.outputs);
        let residual = |((channel, values), output): ((&Channel, &Vec<f64>), &f64)| {
            let residual = values.get(k).copied().filter(|v| v.is_finite())? - output;
            // On a periodic channel, such as an angle, the residual is the shortest way around.
            Some(channel.period.map_or(residual, |period| residual - period * (residual / period).round()))
        };
        channels.zip(outputs).map(residual).collect()
    }
}

/// A random disturbance with mean 0, added to the rate of a state or to the readings of a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Disturbance {
    /// Process noise that is added to the rate of the state with this index.
    Rate(usize),
    /// Autocorrelated measurement noise that is added to the readings of the channel with this index.
    Reading(usize),
}

/// Layout of the filter's state vector: deviations of the system's states from a path, then disturbances.
pub(crate) struct Layout<'a> {
    pub system: SystemWithStates<'a>,
    pub disturbances: &'a [Disturbance],
    /// Correlation of a disturbance from one sample to the next.
    pub correlation: f64,
}

impl Layout<'_> {
    /// Number of components of the filter's state vector: states of the system plus disturbances.
    pub fn size(&self) -> usize {
        self.system.states + self.disturbances.len()
    }

    /// The samples of a record for the Kalman filter, linearised along a path of the N states, `[sample][N]`.
    pub fn samples(&self, record: &Record, path: &[f64], intervals: &[LinearisedInterval]) -> Vec<Sample> {
        let n = self.system.states;
        let sample = |(k, interval): (usize, &LinearisedInterval)| {
            let mut sample = Sample { readings: self.readings(record, k, interval), ..Sample::default() };
            if k + 1 < intervals.len() {
                let dt = record.times[k + 1] - record.times[k];
                sample.transition = self.transition(interval, dt);
                sample.offset = vec![0.0; self.size()];
                let next_on_path = &path[(k + 1) * n..(k + 2) * n];
                let states = sample.offset.iter_mut().zip(&interval.next_state).zip(next_on_path);
                states.for_each(|((offset, simulated), on_path)| *offset = simulated - on_path);
            }
            sample
        };
        intervals.iter().enumerate().map(sample).collect()
    }

    /// Linearised readings at sample `k`; channels without a measured value are left out.
    pub fn readings(&self, record: &Record, k: usize, interval: &LinearisedInterval) -> Vec<Reading> {
        let n = self.system.states;
        let residuals = self.system.residuals(record, k, &interval.outputs);
        let reading = |(channel, residual): (usize, Option<f64>)| {
            let mut jacobian = interval.output_by_state[channel * n..(channel + 1) * n].to_vec();
            let by_disturbance =
                |d: &Disturbance| if *d == Disturbance::Reading(channel) { 1.0 } else { 0.0 };
            jacobian.extend(self.disturbances.iter().map(by_disturbance));
            Some(Reading { channel, residual: residual?, jacobian })
        };
        residuals.into_iter().enumerate().filter_map(reading).collect()
    }

    /// Transition matrix of the D filter states over an interval of `dt` seconds, `[D][D]`.
    ///
    /// A disturbance is constant over an interval. Its effect on the states, the integral of the transition
    /// matrix over the rest of the interval, is approximated by the trapezoidal rule.
    pub fn transition(&self, interval: &LinearisedInterval, dt: f64) -> Vec<f64> {
        let (n, d) = (self.system.states, self.size());
        let mut transition = vec![0.0; d * d];
        for i in 0..n {
            let row = &mut transition[i * d..(i + 1) * d];
            row[..n].copy_from_slice(&interval.next_by_state[i * n..(i + 1) * n]);
            for (j, disturbance) in self.disturbances.iter().enumerate() {
                if let Disturbance::Rate(state) = disturbance {
                    let at_end = if i == *state { 1.0 } else { 0.0 };
                    row[n + j] = 0.5 * dt * (at_end + interval.next_by_state[i * n + state]);
                }
            }
        }
        (n..d).for_each(|j| transition[j * d + j] = self.correlation);
        transition
    }
}
