//! Converts records and tasks to those of the engine, and prepares records for fits.

use super::{EquationSystem, START_SAMPLES};
use crate::engine::{Record as EngineRecord, Signal, Window as EngineWindow};
use crate::model::{FirstSamples, Hold, Input};
use crate::text::Symbol;
use augsim_system::{Record, SimulationError, Stream, Task, Window};
use std::sync::Arc;

/// A simulation task in the form of the engine: record, initial state and parameters.
#[derive(Clone)]
pub(super) struct EngineTask {
    pub(super) record: EngineRecord,
    pub(super) start: Vec<f64>,
    pub(super) parameters: Vec<f64>,
    /// Whether the states of effects begin where their `start` expressions say, and not at values of the task.
    pub(super) computes_starts: bool,
}

/// Returns a number, or 0 if it is not finite.
fn finite_or_zero(x: f64) -> f64 {
    if x.is_finite() { x } else { 0.0 }
}

/// Number of value columns of a prepared input stream: coefficients of the powers 0 to 3 of time.
///
/// The time is counted from the knot at which the cubic begins.
const COEFFICIENTS: usize = 4;

/// Converts a whole input stream, prepared or not, to a signal of the engine.
pub(super) fn signal(input: &Input, stream: &Stream) -> Signal {
    let hold = input.hold.unwrap_or(Hold::Linear);
    match &stream.values[..] {
        [a, b, c, d] => {
            let pieces = (0..stream.times.len()).map(|k| [a[k], b[k], c[k], d[k]]).collect();
            Signal::from_coefficients(stream.times.clone(), pieces, hold)
        }
        [values, ..] => Signal::new(&stream.times, values, hold),
        [] => Signal::new(&[], &[], hold),
    }
}

/// Converts the part of a prepared input stream that a window from `begin` to `end` (s) needs to a signal.
///
/// `delay` is the delay of the input, s; with a negative one the input is used ahead of time.
fn signal_part(input: &Input, stream: &Stream, (begin, end): (f64, f64), delay: f64) -> Signal {
    let hold = input.hold.unwrap_or(Hold::Linear);
    let from = stream.times.partition_point(|t| *t <= begin - delay).saturating_sub(1);
    let to = stream.times.partition_point(|t| *t <= end - delay.min(0.0)).max(from);
    let piece = |k: usize| [0, 1, 2, 3].map(|power| stream.values[power][k]);
    Signal::from_coefficients(stream.times[from..to].to_vec(), (from..to).map(piece).collect(), hold)
}

impl EquationSystem {
    /// Converts a simulation task to the form of the engine.
    pub(super) fn engine_task(&self, task: &Task<'_>) -> Result<EngineTask, SimulationError> {
        let model = self.model();
        let declared = model.declared_states();
        let mut parameters = model.nominals();
        for (place, value) in self.places.iter().zip(task.parameters) {
            parameters[*place] = *value;
        }
        for (place, difference) in self.group_offsets.get(task.record.group).into_iter().flatten() {
            parameters[*place] += difference;
        }
        let mut start = task.start.to_vec();
        let is_unknown = |start: &[f64]| start[declared.min(start.len())..].iter().any(|x| x.is_nan());
        let computes_starts =
            declared < model.states.len() && (start.len() == declared || is_unknown(&start));
        if computes_starts {
            // States of effects start where their expressions say, if the task has no values for them.
            let guessed =
                self.starts_with_effects(task.record, task.window.start, &parameters, &start[..declared]);
            start.resize(model.states.len(), f64::NAN);
            let of_effects = start.iter_mut().zip(guessed).skip(declared);
            of_effects.filter(|(x, _)| x.is_nan()).for_each(|(x, known)| *x = finite_or_zero(known));
        }
        Task { start: &start, ..task.clone() }.check(&self.schema, self.parameters.len())?;
        let times = task.times();
        let (Some(begin), Some(end)) = (times.first(), times.last()) else {
            let system = self.schema.system.clone();
            return Err(SimulationError::Task { system, part: "samples in a window", expected: 1, found: 0 });
        };
        let reach_s = model.low_pass_reach_s();
        let input = |(input, stream): (&Input, &Stream)| {
            if stream.values.len() != COEFFICIENTS {
                return signal(input, stream);
            }
            let delay = input.delay.map_or(0.0, |d| parameters[d]);
            signal_part(input, stream, (*begin - reach_s, *end + reach_s), delay)
        };
        let inputs = model.inputs.iter().zip(task.record.inputs.iter()).map(input).collect();
        let name = format!("trajectory {}", task.record.id);
        let record = EngineRecord::new(&name, times.to_vec(), inputs)
            .map_err(|error| SimulationError::Engine(Box::new(error)))?;
        Ok(EngineTask { record, start, parameters, computes_starts })
    }

    /// Appends the initial states that belong to effects to the declared initial states at a record's first sample.
    ///
    /// States of effects start at the values of their `start` expressions.
    pub fn complete_start(&self, record: &Record, start: &[f64]) -> Vec<f64> {
        let mut full = start.to_vec();
        if start.len() < self.model().states.len() {
            let guessed = self.starts_with_effects(record, 0, &self.model().nominals(), start);
            full.extend(guessed.into_iter().skip(start.len()).map(finite_or_zero));
        }
        full
    }

    /// Initial values of the states of effects at sample `first` of a record, from their `start` expressions, where the
    /// declared states have the values `declared`.
    pub(super) fn starts_of_effects(&self, record: &Record, first: usize, declared: &[f64]) -> Vec<f64> {
        let starts = self.starts_with_effects(record, first, &self.model().nominals(), declared);
        starts.into_iter().skip(self.model().declared_states()).map(finite_or_zero).collect()
    }

    /// The values `declared` of the declared states at sample `first` of a record, and those of the states of effects.
    fn starts_with_effects(
        &self,
        record: &Record,
        first: usize,
        parameters: &[f64],
        declared: &[f64],
    ) -> Vec<f64> {
        let mut known = declared.to_vec();
        known.resize(self.model().declared_states(), f64::NAN);
        self.with_first_samples(record, first, parameters, |samples| {
            self.model().with_starts_of_effects(samples, known)
        })
    }

    /// Guesses the initial state from the model's `start` expressions, on the samples from number `first` on.
    fn guess(&self, record: &Record, first: usize, parameters: &[f64]) -> Vec<f64> {
        self.with_first_samples(record, first, parameters, |samples| self.model().guess_start(samples))
    }

    /// Mean of the prior of an initial state at the beginning of a record, from the state's `start` expression.
    ///
    /// `values` are the values of the system's parameters, `start` the initial values of the states.
    pub(super) fn mean_of_start(&self, record: &Record, state: usize, values: &[f64], start: &[f64]) -> f64 {
        let mut parameters = self.model().nominals();
        for (place, value) in self.places.iter().zip(values) {
            parameters[*place] = *value;
        }
        let mean = self.with_first_samples(record, 0, &parameters, |samples| {
            self.model().start_mean(state, samples, start)
        });
        // Without a reading the rough initial state, in which such a start is 0, is all that is known.
        if mean.is_finite() { mean } else { 0.0 }
    }

    /// Calls `evaluate` with the measured samples of a record from number `first` on.
    fn with_first_samples<T>(
        &self,
        record: &Record,
        first: usize,
        parameters: &[f64],
        evaluate: impl FnOnce(&FirstSamples<'_>) -> T,
    ) -> T {
        let model = self.model();
        let times = record.times.get(first..).unwrap_or(&[]);
        let outputs: Vec<&[f64]> =
            record.values.iter().map(|values| values.get(first..).unwrap_or(&[])).collect();
        let time = times.first().copied().unwrap_or(0.0);
        let inputs: Vec<f64> =
            model.inputs.iter().zip(record.inputs.iter()).map(|(i, s)| input_value(i, s, time)).collect();
        evaluate(&FirstSamples { times, outputs: &outputs, inputs: &inputs, parameters })
    }

    /// Prepares a record: drops saturated readings, converts inputs to cubics, and cuts the record into windows.
    ///
    /// With cubic inputs, a window does not need the whole record. A state whose start cannot be guessed from
    /// outputs begins each window on a simulation of the whole record with nominal parameters.
    pub(super) fn prepare_record(&self, record: &mut Record) {
        let model = self.model();
        for (output, values) in model.outputs.iter().zip(&mut record.values) {
            if let Some([low, high]) = output.range {
                // A reading at the end of the sensor's range only says that the true value is beyond.
                values.iter_mut().filter(|v| **v <= low || **v >= high).for_each(|v| *v = f64::NAN);
            }
        }
        record.use_as_one_window(&self.schema);
        for (input, stream) in model.inputs.iter().zip(Arc::make_mut(&mut record.inputs)) {
            if let [_] = &stream.values[..] {
                let found = signal(input, stream);
                let (times, pieces) = found.coefficients();
                let column = |power: usize| pieces.iter().map(|piece| piece[power]).collect();
                *stream = Stream { times: times.to_vec(), values: (0..COEFFICIENTS).map(column).collect() };
            }
        }
        record.initial_sample_count = START_SAMPLES.min(record.times.len());
        let parameters = model.nominals();
        let record_start: Vec<f64> =
            self.guess(record, 0, &parameters).into_iter().map(finite_or_zero).collect();
        let cuts = self.cuts(&record.times);
        let unmeasured: Vec<usize> =
            (0..model.states.len()).filter(|s| !self.is_guessed_from_outputs(*s)).collect();
        let simulated = (!unmeasured.is_empty() && cuts.len() > 1)
            .then(|| self.states_along(record, &record_start, &parameters))
            .flatten();
        let mut windows = Vec::with_capacity(cuts.len());
        for samples in cuts {
            let mut start = record_start.clone();
            if samples.start > 0 {
                start =
                    self.guess(record, samples.start, &parameters).into_iter().map(finite_or_zero).collect();
                if let Some(states) = &simulated {
                    unmeasured
                        .iter()
                        .for_each(|s| start[*s] = states[samples.start * model.states.len() + *s]);
                }
            }
            start.truncate(model.declared_states());
            windows.push(Window { samples, start });
        }
        record.windows = windows;
    }

    /// Whether the `start` expression of a state depends on an output.
    fn is_guessed_from_outputs(&self, state: usize) -> bool {
        self.model().states[state].start.tree.symbols().any(|s| matches!(s, Symbol::Output(_)))
    }

    /// Cuts a record into windows of equal duration; each starts with the last sample of the one before.
    fn cuts(&self, times: &[f64]) -> Vec<std::ops::Range<usize>> {
        let count = times.len();
        let duration = match (times.first(), times.last()) {
            (Some(first), Some(last)) if count > 2 => last - first,
            _ => return std::iter::once(0..count).collect(),
        };
        let Some(seconds) = self.window_s.filter(|s| *s > 0.0 && *s < duration) else {
            return std::iter::once(0..count).collect();
        };
        let parts = (duration / seconds).round().max(1.0);
        let mut cuts = Vec::new();
        let mut from = 0;
        let mut part = 0;
        while part < parts as usize {
            part += 1;
            let end = times[0] + duration * part as f64 / parts;
            let to = times.partition_point(|t| *t <= end * (1.0 + 1e-12)).clamp(1, count) - 1;
            if to > from + 1 {
                cuts.push(from..to + 1);
                from = to;
            }
            // Parts that end within a pause contain no further sample. A pause of 1e9 s has as many of them.
            if let Some(next) = times.get(to + 1) {
                let before_next = (parts * (next - times[0]) / duration).floor() as usize;
                part = part.max(before_next.saturating_sub(1));
            }
        }
        match cuts.last_mut() {
            Some(last) => last.end = count,
            None => cuts.push(0..count),
        }
        cuts
    }

    /// Simulates all states at all samples of a record from `begin`; `None` if it cannot be simulated.
    fn states_along(&self, record: &Record, begin: &[f64], parameters: &[f64]) -> Option<Vec<f64>> {
        let model = self.model();
        let inputs = model.inputs.iter().zip(record.inputs.iter()).map(|(i, s)| signal(i, s)).collect();
        let whole = EngineRecord::new(&record.id, record.times.clone(), inputs).ok()?;
        let last = record.times.len().checked_sub(1)?;
        let window = EngineWindow { record: &whole, first: 0, last, start: begin, parameters };
        self.compiled.states_along(&window, &self.options).ok()
    }
}

/// Value of an input stream at a time, s.
fn input_value(input: &Input, stream: &Stream, time: f64) -> f64 {
    if stream.values.len() == COEFFICIENTS {
        signal_part(input, stream, (time, time), 0.0).at(time)
    } else {
        signal(input, stream).at(time)
    }
}
