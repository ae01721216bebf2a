//! Variances of what shakes a motion and of what a sensor adds, brought into balance along paths of the states.

use crate::along::{Drive, Interval, Layout, Shown};
use crate::kalman::{Balance, Filter, Noise, Sample, Smoothing, diagonal, smoothed};
use crate::outcome::CalibrationError;
use crate::starts::fit_start;
use augsim_physics::system::{Begin, Offsets, Record, Simulated, SimulationError, System, Task, spread};
use rayon::prelude::*;

/// Rounds in which variances come into balance.
const ROUNDS: usize = 30;
/// Change of the logarithm of a variance below which it has come into balance.
const BALANCED: f64 = 0.01;
/// Most that a variance changes by in one round, as a factor.
const LEAP: f64 = 30.0;
/// Change of a path, in the size of its states, below which it is the last.
const STILL: f64 = 1e-4;
/// Change of a path, in the size of its states, below which the path is one under its cause.
const STAYS: f64 = 1e-2;
/// Share of a rate that is taken to shake it before anything is known.
const ROUGH_SHARE: f64 = 0.1;

/// Records of a system under noise.
pub(crate) struct Noisy<'a> {
    pub shown: Shown<'a>,
    pub records: &'a [Record],
    /// States whose rates may be pushed.
    pushed: &'a [usize],
    /// Standard deviation of sensors that are known, by channel.
    declared: &'a [Option<f64>],
    /// Size of each state, and of each state's rate.
    sizes: Vec<f64>,
    rates: Vec<f64>,
}

/// A cause with its variances.
#[derive(Clone, Debug)]
pub(crate) struct Hypothesis {
    pub drives: Vec<Drive>,
    /// Steps over which drives wander.
    pub memory: f64,
    pub noise: Noise,
    pub ll: f64,
}

impl Hypothesis {
    /// Correlation of a drive from one sample to the next.
    pub fn correlation(&self) -> f64 {
        if self.memory > 0.0 { (-1.0 / self.memory).exp() } else { 0.0 }
    }
}

impl<'a> Noisy<'a> {
    pub fn new(
        system: &'a dyn System,
        outputs: usize,
        records: &'a [Record],
        values: &[f64],
        pushed: &'a [usize],
        declared: &'a [Option<f64>],
    ) -> Result<Self, CalibrationError> {
        if !records.iter().any(|r| r.values.iter().take(outputs).flatten().any(|v| v.is_finite())) {
            return Err(CalibrationError::NothingMeasured);
        }
        let states = system.schema().states.len();
        let shown = Shown { system, outputs, states };
        let mut problem =
            Self { shown, records, pushed, declared, sizes: vec![1.0; states], rates: vec![1.0; states] };
        problem.measure(values);
        Ok(problem)
    }

    /// Sets the sizes of states and rates from runs of the records' windows.
    fn measure(&mut self, values: &[f64]) {
        let n = self.shown.states;
        let (mut squares, mut changes, mut count) = (vec![0.0; n], vec![0.0; n], 0.0_f64);
        let windows = self.records.iter().flat_map(|r| r.windows.iter().map(move |w| (r, w)));
        for (record, window) in windows {
            let task = Task {
                parameters: values,
                record,
                window: window.samples.clone(),
                start: &self.whole_start(&window.start),
                offsets: Offsets::None,
                seeds: &[],
            };
            let mut out = Simulated::default();
            if self.shown.system.simulate(&task, &mut out).is_err() {
                continue;
            }
            for k in 1..out.samples() {
                let dt = record.times[window.samples.start + k] - record.times[window.samples.start + k - 1];
                let state = |k: usize, i: usize| out.value(k, self.shown.outputs + i);
                if (0..n).all(|i| state(k, i).is_finite() && state(k - 1, i).is_finite()) {
                    count += 1.0;
                    for i in 0..n {
                        squares[i] += state(k, i).powi(2);
                        changes[i] += ((state(k, i) - state(k - 1, i)) / dt).powi(2);
                    }
                }
            }
        }
        let size = |sum: f64| {
            Some((sum / count.max(1.0)).sqrt()).filter(|s| s.is_finite() && *s > 0.0).unwrap_or(1.0)
        };
        self.sizes = squares.into_iter().map(size).collect();
        self.rates = changes.into_iter().map(size).collect();
    }

    /// A window's start with the states that effects brought along.
    fn whole_start(&self, start: &[f64]) -> Vec<f64> {
        let states = &self.shown.system.schema().states;
        let rest = states.iter().skip(start.len()).map(|state| match state.begin {
            Begin::Fixed(value) | Begin::Prior(value, _) => value,
            Begin::Free | Begin::Measured(_) => 0.0,
        });
        start.iter().copied().chain(rest).collect()
    }

    pub fn rates_pushed(&self) -> Vec<Drive> {
        self.pushed.iter().map(|s| Drive::Rate(*s)).collect()
    }

    pub fn step_s(&self) -> f64 {
        self.records.iter().map(Record::typical_step).fold(f64::INFINITY, f64::min)
    }

    /// A cause with rough variances.
    pub fn hypothesis(&self, drives: Vec<Drive>, memory: f64) -> Hypothesis {
        let schema = self.shown.system.schema();
        let first = schema.states.iter().zip(&self.sizes).map(|(state, size)| match state.begin {
            Begin::Fixed(_) => 0.0,
            Begin::Prior(_, sd) => sd * sd,
            Begin::Free | Begin::Measured(_) => size * size,
        });
        let first: Vec<f64> = first.collect();
        let declared = |channel: usize| self.declared.get(channel).copied().flatten();
        let rough = |channel: usize| {
            let sd = declared(channel).unwrap_or_else(|| rough_noise(self.records, channel));
            (sd * sd).max(f64::MIN_POSITIVE)
        };
        let read = (0..self.shown.outputs).map(rough).collect();
        let variances: Vec<f64> = drives
            .iter()
            .map(|drive| match drive {
                Drive::Rate(state) => (ROUGH_SHARE * self.rates[*state]).powi(2),
                Drive::Reading(channel) => rough(*channel),
            })
            .collect();
        let noise = Noise { first, added: vec![0.0; self.shown.states], read };
        let mut hypothesis = Hypothesis { drives, memory, noise, ll: f64::NEG_INFINITY };
        self.set_drives(&mut hypothesis, &variances);
        hypothesis
    }

    /// Sets the variances of drives.
    pub fn set_drives(&self, hypothesis: &mut Hypothesis, variances: &[f64]) {
        let n = self.shown.states;
        let fresh = 1.0 - hypothesis.correlation().powi(2);
        hypothesis.noise.first.truncate(n);
        hypothesis.noise.first.extend(variances);
        hypothesis.noise.added = vec![0.0; n];
        hypothesis.noise.added.extend(variances.iter().map(|v| v * fresh));
    }

    /// A path through the readings: an extended Kalman filter with rough variances, not smoothed.
    pub fn rough_path(&self, record: &Record, values: &[f64]) -> Result<Vec<f64>, SimulationError> {
        let n = self.shown.states;
        let hypothesis = self.hypothesis(self.rates_pushed(), 0.0);
        let layout = Layout { shown: self.shown, drives: &hypothesis.drives, memory: 0.0 };
        let begin = record.windows.first().map(|w| w.start.clone()).unwrap_or_default();
        let mut state = self.whole_start(&begin);
        let d = layout.size();
        let mut covariance = diagonal(&hypothesis.noise.first);
        let mut path = Vec::with_capacity(record.times.len() * n);
        for k in 0..record.times.len() {
            let mut filter = Filter::new(covariance, vec![0.0; d]);
            let here = self.shown.from(record, values, k, &state)?;
            for reading in layout.readings(record, k, &here) {
                filter.take(&reading, hypothesis.noise.read[reading.channel]);
            }
            state.iter_mut().zip(&filter.mean).for_each(|(s, m)| *s += m);
            path.extend(&state);
            if k + 1 == record.times.len() {
                break;
            }
            let there = self.shown.from(record, values, k, &state)?;
            let next = layout.next(&there, record.times[k + 1] - record.times[k]);
            let offset = vec![0.0; d];
            filter.advance(&Sample { offset, next, readings: Vec::new() }, &hypothesis.noise.added);
            state = there.reached;
            covariance = filter.covariance;
        }
        Ok(path)
    }

    /// Runs of the model from the starts that fit whole records best.
    pub fn runs(&self, values: &[f64]) -> Result<Vec<Vec<f64>>, CalibrationError> {
        let run = |record: &Record| {
            // Nobody measures the states that are shown.
            let mut record = record.clone();
            record.values.truncate(self.shown.outputs);
            record.values.extend(vec![vec![f64::NAN; record.times.len()]; self.shown.states]);
            let rough =
                self.whole_start(&record.windows.first().map(|w| w.start.clone()).unwrap_or_default());
            let samples = record.times.len();
            let begun = fit_start(self.shown.system, &record, samples, values, &rough, self.declared)?;
            let task = Task {
                parameters: values,
                record: &record,
                window: 0..samples,
                start: &begun.state,
                offsets: Offsets::None,
                seeds: &[],
            };
            let mut out = Simulated::default();
            self.shown.system.simulate(&task, &mut out).map_err(CalibrationError::Simulation)?;
            let states = |k: usize| (0..self.shown.states).map(move |i| (k, self.shown.outputs + i));
            Ok((0..samples).flat_map(states).map(|(k, channel)| out.value(k, channel)).collect())
        };
        self.records.par_iter().map(run).collect()
    }

    pub fn intervals(
        &self,
        values: &[f64],
        paths: &[Vec<f64>],
        by: &[usize],
    ) -> Result<Vec<Vec<Interval>>, CalibrationError> {
        let all = self.records.iter().zip(paths);
        let of = |(record, path): (&Record, &Vec<f64>)| self.shown.along(record, values, path, by);
        all.map(of).collect::<Result<_, _>>().map_err(CalibrationError::Simulation)
    }

    /// Brings the variances of a cause into balance along paths, over the first samples of each record.
    pub fn balanced(
        &self,
        from: Hypothesis,
        paths: &[Vec<f64>],
        intervals: &[Vec<Interval>],
        samples: &[usize],
    ) -> (Hypothesis, Vec<Smoothing>) {
        let mut hypothesis = from;
        let n = self.shown.states;
        let (drives, memory) = (hypothesis.drives.clone(), hypothesis.correlation());
        let layout = Layout { shown: self.shown, drives: &drives, memory };
        let lists: Vec<Vec<Sample>> = (self.records.par_iter().zip(paths).zip(intervals).zip(samples))
            .filter(|(_, count)| **count > 1)
            .map(|(((record, path), intervals), count)| layout.samples(record, path, &intervals[..*count]))
            .collect();
        let mut found: Vec<Smoothing> = Vec::new();
        for _ in 0..ROUNDS {
            found = lists.par_iter().map(|list| smoothed(list, &hypothesis.noise)).collect();
            hypothesis.ll = found.iter().map(|s| s.ll).sum();
            let mut largest = 0.0_f64;
            let mut ratio = |balance: Balance| {
                let ratio = (balance.found / balance.expected).clamp(1.0 / LEAP, LEAP);
                let ratio = if ratio.is_finite() { ratio } else { 1.0 };
                largest = largest.max(ratio.ln().abs());
                ratio
            };
            let fresh = 1.0 - hypothesis.correlation().powi(2);
            let variances: Vec<f64> = (0..drives.len())
                .map(|j| {
                    let sum = found.iter().fold(Balance::default(), |sum, s| Balance {
                        found: sum.found + s.first[n + j].found + fresh * s.added[n + j].found,
                        expected: sum.expected + s.first[n + j].expected + fresh * s.added[n + j].expected,
                    });
                    hypothesis.noise.first[n + j] * ratio(sum)
                })
                .collect();
            for channel in 0..self.shown.outputs {
                if self.declared.get(channel).copied().flatten().is_some() {
                    continue;
                }
                let sum = found.iter().fold(Balance::default(), |sum, s| Balance {
                    found: sum.found + s.read[channel].found,
                    expected: sum.expected + s.read[channel].expected,
                });
                hypothesis.noise.read[channel] *= ratio(sum);
            }
            self.set_drives(&mut hypothesis, &variances);
            if largest < BALANCED {
                break;
            }
        }
        (hypothesis, found)
    }

    /// Smooths paths under a cause, each linearised along the one before, until they stay; and whether they stay.
    pub fn settled(
        &self,
        from: Hypothesis,
        values: &[f64],
        paths: &mut [Vec<f64>],
        most: usize,
    ) -> Result<(Hypothesis, bool), CalibrationError> {
        let all: Vec<usize> = self.records.iter().map(|r| r.times.len()).collect();
        let (mut hypothesis, n) = (from, self.shown.states);
        let d = n + hypothesis.drives.len();
        let mut largest = f64::INFINITY;
        for _ in 0..most {
            let intervals = self.intervals(values, paths, &[])?;
            let (found, smoothings) = self.balanced(hypothesis, paths, &intervals, &all);
            hypothesis = found;
            largest = 0.0;
            for (path, smoothing) in paths.iter_mut().zip(&smoothings) {
                for (point, deviation) in path.chunks_exact_mut(n).zip(smoothing.deviations.chunks_exact(d)) {
                    for ((x, by), size) in point.iter_mut().zip(deviation).zip(&self.sizes) {
                        *x += by;
                        largest = largest.max(by.abs() / size);
                    }
                }
            }
            if largest < STILL {
                break;
            }
        }
        Ok((hypothesis, largest < STAYS))
    }
}

/// Rough noise of a channel from its third differences, which a motion that is smooth from sample to sample hardly has.
fn rough_noise(records: &[Record], channel: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for record in records {
        let Some(values) = record.values.get(channel) else { continue };
        for four in values.windows(4) {
            let third = four[3] - 3.0 * four[2] + 3.0 * four[1] - four[0];
            if third.is_finite() {
                sum += third * third;
                count += 1.0;
            }
        }
    }
    // Squares of 1, 3, 3 and 1.
    let sd = (sum / (20.0 * count.max(1.0))).sqrt();
    sd.max(1e-9 * spread(records, channel))
}
