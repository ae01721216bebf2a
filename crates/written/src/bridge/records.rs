//! Records of the loop as the engine takes them.

use super::{KNOWN, WrittenSystem};
use crate::engine::{Record as EngineRecord, Signal, Window as EngineWindow};
use crate::model::{FirstSamples, Hold, Input};
use crate::text::Symbol;
use augsim_physics::system::{Record, SimulationError, Stream, Task, Window};
use std::sync::Arc;

/// A task as the engine takes it.
pub(super) struct Scene {
    pub(super) record: EngineRecord,
    pub(super) start: Vec<f64>,
    pub(super) parameters: Vec<f64>,
}

/// Columns of a prepared stream: the powers 0 to 3 of the time since each knot.
const POWERS: usize = 4;

/// The signal of a whole stream, prepared or not.
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

/// The part of a prepared stream that a window from `begin` to `end` needs, with `delay` seconds before it, or behind it where the delay is
/// below 0.
fn part(input: &Input, stream: &Stream, (begin, end): (f64, f64), delay: f64) -> Signal {
    let hold = input.hold.unwrap_or(Hold::Linear);
    let from = stream.times.partition_point(|t| *t <= begin - delay).saturating_sub(1);
    let to = stream.times.partition_point(|t| *t <= end - delay.min(0.0)).max(from);
    let piece = |k: usize| [0, 1, 2, 3].map(|power| stream.values[power][k]);
    Signal::from_coefficients(stream.times[from..to].to_vec(), (from..to).map(piece).collect(), hold)
}

impl WrittenSystem {
    /// Everything that the engine needs for a task.
    pub(super) fn scene(&self, task: &Task<'_>) -> Result<Scene, SimulationError> {
        let model = self.model();
        let declared = model.declared_states();
        let mut parameters = model.nominals();
        for (place, value) in self.places.iter().zip(task.parameters) {
            parameters[*place] = *value;
        }
        let mut start = task.start.to_vec();
        if start.len() == declared && declared < model.states.len() {
            // States that effects bring along begin where they say; the loop does not know them.
            let guess = self.guess(task.record, task.window.start, &parameters);
            start.extend(guess.into_iter().skip(declared).map(|x| if x.is_finite() { x } else { 0.0 }));
        }
        Task { start: &start, ..task.clone() }.check(&self.schema, self.parameters.len())?;
        let times = task.times();
        let (Some(begin), Some(end)) = (times.first(), times.last()) else {
            let system = self.schema.system.clone();
            return Err(SimulationError::Task { system, part: "samples in a window", expected: 1, found: 0 });
        };
        let input = |(input, stream): (&Input, &Stream)| {
            if stream.values.len() != POWERS {
                return signal(input, stream);
            }
            let delay = input.delay.map_or(0.0, |d| parameters[d]);
            part(input, stream, (*begin, *end), delay)
        };
        let inputs = model.inputs.iter().zip(task.record.inputs.iter()).map(input).collect();
        let name = format!("trajectory {}", task.record.id);
        let record = EngineRecord::new(&name, times.to_vec(), inputs)
            .map_err(|error| SimulationError::Engine(Box::new(error)))?;
        Ok(Scene { record, start, parameters })
    }

    /// All states at the first sample of a record, of which `start` holds those that the file declares: states that effects brought along
    /// begin where they say.
    pub fn full_start(&self, record: &Record, start: &[f64]) -> Vec<f64> {
        let mut full = start.to_vec();
        if start.len() < self.model().states.len() {
            let guess = self.guess(record, 0, &self.model().nominals());
            full.extend(guess.into_iter().skip(start.len()).map(|x| if x.is_finite() { x } else { 0.0 }));
        }
        full
    }

    /// Start states that the model's `start` expressions guess from sample `first` of a record on.
    fn guess(&self, record: &Record, first: usize, parameters: &[f64]) -> Vec<f64> {
        let model = self.model();
        let times = record.times.get(first..).unwrap_or(&[]);
        let outputs: Vec<&[f64]> =
            record.values.iter().map(|values| values.get(first..).unwrap_or(&[])).collect();
        let at = times.first().copied().unwrap_or(0.0);
        let inputs: Vec<f64> =
            model.inputs.iter().zip(record.inputs.iter()).map(|(i, s)| value(i, s, at)).collect();
        model.guess_start(&FirstSamples { times, outputs: &outputs, inputs: &inputs, parameters })
    }

    /// Turns inputs into cubics, so that windows need no look at the whole record, and cuts the record into windows. A state
    /// that no output tells begins a window where a simulation of the record with nominal values passes.
    pub(super) fn prepare_record(&self, record: &mut Record) {
        let model = self.model();
        for (output, values) in model.outputs.iter().zip(&mut record.values) {
            if let Some([low, high]) = output.range {
                // At the end of its range a sensor says nothing but that the value is beyond.
                values.iter_mut().filter(|v| **v <= low || **v >= high).for_each(|v| *v = f64::NAN);
            }
        }
        record.whole(&self.schema);
        for (input, stream) in model.inputs.iter().zip(Arc::make_mut(&mut record.inputs)) {
            if let [_] = &stream.values[..] {
                let found = signal(input, stream);
                let (times, pieces) = found.coefficients();
                let column = |power: usize| pieces.iter().map(|piece| piece[power]).collect();
                *stream = Stream { times: times.to_vec(), values: (0..POWERS).map(column).collect() };
            }
        }
        record.known = KNOWN.min(record.times.len());
        let parameters = model.nominals();
        let clean = |x: f64| if x.is_finite() { x } else { 0.0 };
        let begin: Vec<f64> = self.guess(record, 0, &parameters).into_iter().map(clean).collect();
        let cuts = self.cuts(&record.times);
        let unseen: Vec<usize> = (0..model.states.len()).filter(|s| !self.is_told(*s)).collect();
        let simulated = (!unseen.is_empty() && cuts.len() > 1)
            .then(|| self.states_along(record, &begin, &parameters))
            .flatten();
        let mut windows = Vec::with_capacity(cuts.len());
        for samples in cuts {
            let mut start = begin.clone();
            if samples.start > 0 {
                start = self.guess(record, samples.start, &parameters).into_iter().map(clean).collect();
                if let Some(along) = &simulated {
                    unseen.iter().for_each(|s| start[*s] = along[samples.start * model.states.len() + *s]);
                }
            }
            start.truncate(model.declared_states());
            windows.push(Window { samples, start });
        }
        record.windows = windows;
    }

    /// Whether an output helps to guess a state.
    fn is_told(&self, state: usize) -> bool {
        self.model().states[state].start.tree.symbols().any(|s| matches!(s, Symbol::Output(_)))
    }

    /// Sample ranges of equal windows, each with the first sample of the next; a rest of less than half a window joins the
    /// last.
    fn cuts(&self, times: &[f64]) -> Vec<std::ops::Range<usize>> {
        let count = times.len();
        let lasts = match (times.first(), times.last()) {
            (Some(first), Some(last)) if count > 2 => last - first,
            _ => return std::iter::once(0..count).collect(),
        };
        let Some(seconds) = self.window_s.filter(|s| *s > 0.0 && *s < lasts) else {
            return std::iter::once(0..count).collect();
        };
        let parts = (lasts / seconds).round().max(1.0);
        let mut cuts = Vec::new();
        let mut from = 0;
        for part in 1..=parts as usize {
            let end = times[0] + lasts * part as f64 / parts;
            let to = times.partition_point(|t| *t <= end * (1.0 + 1e-12)).clamp(1, count) - 1;
            if to > from + 1 {
                cuts.push(from..to + 1);
                from = to;
            }
        }
        match cuts.last_mut() {
            Some(last) => last.end = count,
            None => cuts.push(0..count),
        }
        cuts
    }

    /// All states at all samples of a record, from its beginning; nothing where it cannot be simulated.
    fn states_along(&self, record: &Record, begin: &[f64], parameters: &[f64]) -> Option<Vec<f64>> {
        let model = self.model();
        let inputs = model.inputs.iter().zip(record.inputs.iter()).map(|(i, s)| signal(i, s)).collect();
        let whole = EngineRecord::new(&record.id, record.times.clone(), inputs).ok()?;
        let last = record.times.len().checked_sub(1)?;
        let window = EngineWindow { record: &whole, first: 0, last, start: begin, parameters };
        self.compiled.states_along(&window, &self.options).ok()
    }
}

/// Value of an input at a time.
fn value(input: &Input, stream: &Stream, at: f64) -> f64 {
    if stream.values.len() == POWERS {
        part(input, stream, (at, at), 0.0).at(at)
    } else {
        signal(input, stream).at(at)
    }
}
