//! A system linearised along a path: one interval at a time.

use crate::kalman::{Reading, Sample};
use augsim_physics::system::{Offsets, Record, Seed, Simulated, SimulationError, System, Task};
use rayon::prelude::*;

/// A system whose channels are its outputs and, behind them, its states.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shown<'a> {
    pub system: &'a dyn System,
    /// Number of outputs: channels that a sensor reads.
    pub outputs: usize,
    /// Number of states.
    pub states: usize,
}

/// The motion from a point of a path to the next sample, and what is read at the point. Matrices are in rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Interval {
    /// Where the motion leads from the point, `[N]`; empty at the last sample.
    pub reached: Vec<f64>,
    /// Its derivatives by the point, `[N][N]`.
    pub by_state: Vec<f64>,
    /// Its derivatives by the parameters that were asked for, `[N][P]`.
    pub by_parameter: Vec<f64>,
    /// Outputs at the point, `[C]`, with their derivatives, `[C][N]` and `[C][P]`.
    pub outputs: Vec<f64>,
    pub output_by_state: Vec<f64>,
    pub output_by_parameter: Vec<f64>,
}

impl<'a> Shown<'a> {
    /// The interval behind every sample of a record along a path `[sample][N]`, with derivatives by the parameters `by`.
    ///
    /// # Errors
    /// The first interval that cannot be simulated.
    pub fn along(
        &self,
        record: &Record,
        values: &[f64],
        path: &[f64],
        by: &[usize],
    ) -> Result<Vec<Interval>, SimulationError> {
        let seeds = self.seeds(by);
        let count = record.times.len();
        let places: Vec<usize> = (0..count).collect();
        let each = 16 * self.system.side_by_side().max(1);
        let intervals = |places: &[usize]| -> Vec<Result<Interval, SimulationError>> {
            let task = |k: &usize| {
                self.task(record, values, *k, &path[k * self.states..(k + 1) * self.states], &seeds)
            };
            let tasks: Vec<Task<'_>> = places.iter().map(task).collect();
            let mut out = vec![Simulated::default(); tasks.len()];
            let done = self.system.simulate_all(&tasks, &mut out);
            done.into_iter().zip(&out).map(|(done, out)| done.map(|()| self.interval(out))).collect()
        };
        places.par_chunks(each).flat_map_iter(intervals).collect()
    }

    /// The interval behind one sample, from one state.
    ///
    /// # Errors
    /// It cannot be simulated.
    pub fn from(
        &self,
        record: &Record,
        values: &[f64],
        k: usize,
        state: &[f64],
    ) -> Result<Interval, SimulationError> {
        let seeds = self.seeds(&[]);
        let mut out = Simulated::default();
        self.system.simulate(&self.task(record, values, k, state, &seeds), &mut out)?;
        Ok(self.interval(&out))
    }

    fn seeds(&self, by: &[usize]) -> Vec<Seed> {
        (0..self.states).map(Seed::Start).chain(by.iter().map(|p| Seed::Parameter(*p))).collect()
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

    fn interval(&self, out: &Simulated) -> Interval {
        let (n, c) = (self.states, self.outputs);
        let mut interval = Interval::default();
        for channel in 0..c {
            interval.outputs.push(out.value(0, channel));
            interval.output_by_state.extend(&out.slopes(0, channel)[..n]);
            interval.output_by_parameter.extend(&out.slopes(0, channel)[n..out.lanes()]);
        }
        if out.samples() > 1 {
            for state in 0..n {
                interval.reached.push(out.value(1, c + state));
                interval.by_state.extend(&out.slopes(1, c + state)[..n]);
                interval.by_parameter.extend(&out.slopes(1, c + state)[n..out.lanes()]);
            }
        }
        interval
    }

    /// Readings of a record at a sample less the outputs that were simulated, channel by channel; nothing where none was measured.
    pub fn missed(&self, record: &Record, k: usize, outputs: &[f64]) -> Vec<Option<f64>> {
        let channels = self.system.schema().channels.iter().zip(&record.values).take(self.outputs);
        let of = |((channel, values), output): ((_, &Vec<f64>), &f64)| {
            let channel: &augsim_physics::system::Channel = channel;
            let missed = values.get(k).copied().filter(|v| v.is_finite())? - output;
            Some(channel.period.map_or(missed, |period| missed - period * (missed / period).round()))
        };
        channels.zip(outputs).map(of).collect()
    }
}

/// A number that wanders about 0: it pushes the rate of a state, or shifts the readings of a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Drive {
    Rate(usize),
    Reading(usize),
}

/// Deviations from a path: states, then drives.
pub(crate) struct Layout<'a> {
    pub shown: Shown<'a>,
    pub drives: &'a [Drive],
    /// Correlation of a drive from one sample to the next.
    pub memory: f64,
}

impl Layout<'_> {
    /// Number of components.
    pub fn size(&self) -> usize {
        self.shown.states + self.drives.len()
    }

    /// A record along a path `[sample][N]` for the filter.
    pub fn samples(&self, record: &Record, path: &[f64], intervals: &[Interval]) -> Vec<Sample> {
        let n = self.shown.states;
        let at = |k: usize| &path[k * n..(k + 1) * n];
        let of = |(k, interval): (usize, &Interval)| {
            let mut sample = Sample { readings: self.readings(record, k, interval), ..Sample::default() };
            if k + 1 < intervals.len() {
                let dt = record.times[k + 1] - record.times[k];
                sample.next = self.next(interval, dt);
                sample.offset = vec![0.0; self.size()];
                let off = interval.reached.iter().zip(at(k + 1));
                sample.offset.iter_mut().zip(off).for_each(|(to, (reached, there))| *to = reached - there);
            }
            sample
        };
        intervals.iter().enumerate().map(of).collect()
    }

    /// Readings at a sample.
    pub fn readings(&self, record: &Record, k: usize, interval: &Interval) -> Vec<Reading> {
        let n = self.shown.states;
        let missed = self.shown.missed(record, k, &interval.outputs);
        let reading = |(channel, missed): (usize, Option<f64>)| {
            let mut by = interval.output_by_state[channel * n..(channel + 1) * n].to_vec();
            by.extend(self.drives.iter().map(|d| if *d == Drive::Reading(channel) { 1.0 } else { 0.0 }));
            Some(Reading { channel, missed: missed?, by })
        };
        missed.into_iter().enumerate().filter_map(reading).collect()
    }

    /// Derivatives of the next deviation by this one, over `dt` seconds. A drive is constant over an interval; what it moves
    /// is carried on by the trapezium of the derivatives at both ends.
    pub fn next(&self, interval: &Interval, dt: f64) -> Vec<f64> {
        let (n, d) = (self.shown.states, self.size());
        let mut next = vec![0.0; d * d];
        for i in 0..n {
            let row = &mut next[i * d..(i + 1) * d];
            row[..n].copy_from_slice(&interval.by_state[i * n..(i + 1) * n]);
            for (j, drive) in self.drives.iter().enumerate() {
                if let Drive::Rate(state) = drive {
                    let still = if i == *state { 1.0 } else { 0.0 };
                    row[n + j] = 0.5 * dt * (still + interval.by_state[i * n + state]);
                }
            }
        }
        (n..d).for_each(|j| next[j * d + j] = self.memory);
        next
    }
}
