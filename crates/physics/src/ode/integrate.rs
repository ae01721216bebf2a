//! Integrates state equations over one window, with adaptive steps, events and rest.
//!
//! The length of the steps depends on the plain values alone. The derivatives are those of the steps that
//! were taken (internal differentiation, Bock 1981). The time of an event is first found in plain values. One
//! Newton step on the integration step, in the scalar of the simulation, then adds its derivatives, so that
//! the states after the event have the right derivatives without a formula for the jump.

use super::crossing::{Crossing, first_crossing};
use super::equations::{At, Equations};
use super::inputs::Inputs;
use super::limits::{MAX_EVENTS, MAX_STEPS, Tolerance};
use super::step::Step;
use crate::lanes::{seeded, store};
use crate::{Dual, Scalar};
use augsim_system::{Offsets, Seed, Simulated, SimulationError, Task};

/// Smallest step, relative to the absolute time or to 1 s, whichever is larger.
const SMALLEST_STEP: f64 = 1e-14;
/// Number of Newton steps for the time of an event; the last one adds the derivatives.
const NEWTON_STEPS: usize = 3;

/// Equations that currently determine the rates of the states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// The state equations hold.
    Free,
    /// The system rests after the event with this index.
    Resting(usize),
}

/// Integration of the equations over one window: equations, task, current step and counters.
pub(super) struct Integration<'a, E, S> {
    equations: &'a E,
    task: &'a Task<'a>,
    tolerance: Tolerance,
    parameters: Vec<S>,
    values: Vec<f64>,
    offsets: Vec<S>,
    inputs: Inputs<'a>,
    mode: Mode,
    step: Step<S>,
    events: usize,
    emitted: usize,
}

impl<'a, E: Equations, S: Scalar> Integration<'a, E, S> {
    /// An integration at the start of the task's window.
    ///
    /// `values` are all parameters of the equations; `place` maps a parameter of the task to its index
    /// in them.
    pub fn new(
        equations: &'a E,
        task: &'a Task<'a>,
        tolerance: Tolerance,
        values: Vec<f64>,
        place: impl Fn(usize) -> usize,
    ) -> Self {
        let parameters =
            seeded(&values, task.seeds, |s| if let Seed::Parameter(i) = s { Some(place(i)) } else { None });
        let start = seeded(task.start, task.seeds, |s| if let Seed::Start(i) = s { Some(i) } else { None });
        let offset = |s: Seed| if let Seed::Offset(i) = s { Some(i) } else { None };
        let offsets = match task.offsets {
            Offsets::None => Vec::new(),
            Offsets::Shared(x) => seeded(&[x], task.seeds, offset),
            Offsets::PerEvent(list) => seeded(list, task.seeds, offset),
        };
        let begin = task.times().first().copied().unwrap_or(0.0);
        Self {
            equations,
            task,
            tolerance,
            parameters,
            values,
            offsets,
            inputs: Inputs::new(equations.schema(), task.record, begin),
            mode: Mode::Free,
            step: Step::new(S::constant(begin), start),
            events: 0,
            emitted: 0,
        }
    }

    /// Integrates over the window and writes the samples to `out`.
    pub fn run(&mut self, out: &mut Simulated) -> Result<(), SimulationError> {
        let schema = self.equations.schema();
        let times = self.task.times();
        out.reset(times.len(), schema.channels.len(), self.task.seeds.len(), schema.features.len());
        let Some(&last) = times.last() else { return Ok(()) };
        let (mut steps, mut first_known, mut length) = (0, false, f64::NAN);
        self.begin_on_an_event(out)?;
        loop {
            let now = self.step.time.value();
            if now >= self.inputs.end() {
                self.inputs.enter(now);
                first_known = false;
            }
            self.emit(now, out);
            if self.emitted >= times.len() {
                return Ok(());
            }
            let stop = self.inputs.end().min(last);
            if !length.is_finite() {
                length = self.first_length(stop - now);
            }
            let whole = now + length * (1.0 + 1e-9) >= stop;
            let (short, long) = (S::constant(length), S::constant(stop) - self.step.time);
            self.take(if whole { long } else { short }, first_known);
            steps += 1;
            let error = self.step.error(self.tolerance.relative, self.tolerance.absolute);
            // A step of fifth order whose error is to be the tolerance; a fifth off, so that it is met.
            let grow =
                if error.is_finite() { (0.8 * error.max(1e-10).powf(-0.2)).clamp(0.2, 5.0) } else { 0.2 };
            if error.is_nan() || error > 1.0 {
                first_known = true;
                length = self.step.length.value() * grow.min(0.9);
                self.check_length(length, now, error)?;
                self.check_steps(steps, now)?;
                continue;
            }
            self.check_steps(steps, now)?;
            let taken = self.step.length.value();
            if let Some((event, share)) = self.next_event()? {
                self.stop_at(event, share);
                self.emit(self.step.time.value() + self.step.length.value(), out);
                self.pass(event, out)?;
                first_known = false;
                length = taken;
                continue;
            }
            let end = if whole { S::constant(stop) } else { self.step.time + self.step.length };
            self.emit(end.value(), out);
            self.step.advance(end);
            first_known = true;
            // A step that an input's sample cut short says nothing against the longer one that was due.
            length = if whole { length.max(taken * grow) } else { taken * grow };
        }
    }

    fn rate<T: Scalar>(
        &self,
        inputs: &Inputs<'_>,
        parameters: &[T],
        at: (T, &[T]),
        u: &mut Vec<T>,
        out: &mut [T],
    ) {
        inputs.at(at.0, u);
        let covariates = &self.task.record.covariates;
        let at = At { time: at.0, states: at.1, inputs: u, parameters, covariates };
        match self.mode {
            Mode::Free => self.equations.derivative(&at, out),
            Mode::Resting(event) => {
                out.fill(T::zero());
                self.equations.resting(event, &at, out);
            }
        }
    }

    fn take(&mut self, length: S, first_known: bool) {
        let mut step = std::mem::replace(&mut self.step, Step::new(S::zero(), Vec::new()));
        let mut u = Vec::new();
        step.take(length, first_known, &mut |t, x, out| {
            self.rate(&self.inputs, &self.parameters, (t, x), &mut u, out);
        });
        self.step = step;
    }

    /// Length of the first step, s: the states change over it by about 1 % of their size.
    fn first_length(&mut self, most: f64) -> f64 {
        let (n, mut u) = (self.step.start.len(), Vec::new());
        let mut rates = vec![S::zero(); n];
        self.rate(&self.inputs, &self.parameters, (self.step.time, &self.step.start), &mut u, &mut rates);
        let Tolerance { relative, absolute } = self.tolerance;
        let (mut size, mut speed) = (0.0, 0.0);
        for (x, rate) in self.step.start.iter().zip(&rates) {
            let scale = absolute + relative * x.value().abs();
            size += (x.value() / scale).powi(2);
            speed += (rate.value() / scale).powi(2);
        }
        let guess = 0.01 * f64::sqrt(size / speed);
        if guess.is_finite() && guess > 0.0 { guess.clamp(1e-6 * most, most) } else { 1e-3 * most }
    }

    fn check_length(&self, length: f64, time_s: f64, error: f64) -> Result<(), SimulationError> {
        if length > SMALLEST_STEP * time_s.abs().max(1.0) {
            return Ok(());
        }
        let system = self.equations.schema().system.clone();
        if error.is_finite() {
            Err(SimulationError::Steps { system, steps: MAX_STEPS, time_s })
        } else {
            Err(SimulationError::NotFinite { system, time_s })
        }
    }

    fn check_steps(&self, steps: usize, time_s: f64) -> Result<(), SimulationError> {
        let system = || self.equations.schema().system.clone();
        if steps < MAX_STEPS {
            Ok(())
        } else {
            Err(SimulationError::Steps { system: system(), steps: MAX_STEPS, time_s })
        }
    }

    /// Event function of `event`, or its release function if the system rests after that event.
    fn function<T: Scalar>(
        &self,
        event: usize,
        parameters: &[T],
        time: T,
        states: &[T],
        u: &mut Vec<T>,
    ) -> T {
        self.inputs.at(time, u);
        let covariates = &self.task.record.covariates;
        let at = At { time, states, inputs: u, parameters, covariates };
        if self.mode == Mode::Resting(event) {
            self.equations.release(event, &at)
        } else {
            self.equations.event(event, &at)
        }
    }

    /// Time derivative of the event function of `event`, given the states and their rates.
    fn function_rate(&self, event: usize, time: f64, states: &[S], rates: &[S]) -> f64 {
        let moving = |value: f64, rate: f64| Dual::<1> { value, d: [rate] };
        let along: Vec<Dual<1>> =
            states.iter().zip(rates).map(|(x, r)| moving(x.value(), r.value())).collect();
        let constants: Vec<Dual<1>> = self.values.iter().map(|&v| Dual::constant(v)).collect();
        self.function(event, &constants, moving(time, 1.0), &along, &mut Vec::new()).d[0]
    }

    /// First event within the step, as its index and the fraction of the step at which it happens.
    fn next_event(&self) -> Result<Option<(usize, f64)>, SimulationError> {
        let count = self.equations.events();
        if count == 0 {
            return Ok(None);
        }
        let plain = self.step.values();
        let begin = plain.time;
        let (mut states, mut u) = (Vec::new(), Vec::new());
        let mut first: Option<(usize, f64)> = None;
        for event in 0..count {
            let rising = self.function_rate(event, begin, &self.step.start, self.step.start_rates()) > 0.0;
            let crossing = first_crossing(
                |share| {
                    plain.at(share, &mut states);
                    self.function(event, &self.values, begin + share * plain.length, &states, &mut u)
                },
                rising,
            );
            match crossing {
                Crossing::At(share) if first.is_none_or(|(_, s)| share < s) => first = Some((event, share)),
                Crossing::Zeno => return Err(self.too_many_events(begin)),
                _ => {}
            }
        }
        Ok(first)
    }

    /// Shortens the step to end at the event; the length then carries the derivatives of the event's time.
    fn stop_at(&mut self, event: usize, share: f64) {
        let whole = self.step.length.value();
        let begin = self.step.time;
        let mut length = S::constant(share * whole);
        for _ in 0..NEWTON_STEPS {
            let guess = S::constant(length.value());
            self.take(guess, true);
            let states = &self.step.end;
            let g = self.function(event, &self.parameters, begin + guess, states, &mut Vec::new());
            let time = (begin + guess).value();
            let rate = self.function_rate(event, time, states, self.step.end_rates());
            length = guess - g * (1.0 / rate);
            // A grazing event has no rate to follow: the bracket is the answer, and nothing is known of its derivative.
            if !(0.0..=1.01 * whole).contains(&length.value()) {
                length = S::constant(share * whole);
                break;
            }
        }
        self.take(length, true);
    }

    /// Passes an event at the initial state if its function is zero there and falls.
    fn begin_on_an_event(&mut self, out: &mut Simulated) -> Result<(), SimulationError> {
        for event in 0..self.equations.events() {
            let (time, mut u) = (self.step.time, Vec::new());
            let mut rates = vec![S::zero(); self.step.start.len()];
            self.rate(&self.inputs, &self.parameters, (time, &self.step.start), &mut u, &mut rates);
            let g = self.function(event, &self.parameters, time, &self.step.start, &mut u);
            let rate = self.function_rate(event, time.value(), &self.step.start, &rates);
            if g.value() == 0.0 && rate < 0.0 {
                self.step.end = self.step.start.clone();
                self.step.length = S::zero();
                self.pass(event, out)?;
            }
        }
        Ok(())
    }

    /// Passes the event at which the step ends: resets the states, and begins or ends a rest.
    fn pass(&mut self, event: usize, out: &mut Simulated) -> Result<(), SimulationError> {
        let time = self.step.time + self.step.length;
        if self.mode == Mode::Resting(event) {
            self.mode = Mode::Free;
            let states = self.step.end.clone();
            self.step.begin(time, &states);
        } else {
            let mut parameters = self.parameters.clone();
            let offset = match self.task.offsets {
                Offsets::Shared(_) => self.offsets.first(),
                _ => self.offsets.get(out.event_times().len()),
            };
            if let (Some(schema), Some(&offset)) = (&self.equations.schema().event, offset) {
                parameters[schema.parameter] += offset;
            }
            let (mut u, mut states) = (Vec::new(), self.step.end.clone());
            self.inputs.at(time, &mut u);
            let covariates = &self.task.record.covariates;
            let before = &self.step.end;
            let at = At { time, states: before, inputs: &u, parameters: &parameters, covariates };
            self.equations.reset(event, &at, &mut states);
            out.push_event(time.value(), []);
            let plain: Vec<f64> = states.iter().map(|x| x.value()).collect();
            let inputs: Vec<f64> = u.iter().map(|x| x.value()).collect();
            let parameters = &self.values;
            let at = At { time: time.value(), states: &plain, inputs: &inputs, parameters, covariates };
            // Whoever is released already does not come to rest.
            if self.equations.rests(event, &at) && self.equations.release(event, &at) > 0.0 {
                self.mode = Mode::Resting(event);
            }
            self.step.begin(time, &states);
        }
        self.events += 1;
        if self.events > MAX_EVENTS {
            return Err(self.too_many_events(time.value()));
        }
        Ok(())
    }

    fn too_many_events(&self, time_s: f64) -> SimulationError {
        let system = self.equations.schema().system.clone();
        SimulationError::Events { system, events: self.events, time_s }
    }

    /// Writes the samples up to time `until` from the interpolated step.
    fn emit(&mut self, until: f64, out: &mut Simulated) {
        let schema = self.equations.schema();
        let (mut states, mut u) = (Vec::new(), Vec::new());
        let mut channels = vec![S::zero(); schema.channels.len()];
        while let Some(&sample) = self.task.times().get(self.emitted) {
            if sample > until {
                return;
            }
            let time = S::constant(sample);
            if sample <= self.step.time.value() {
                states.clone_from(&self.step.start);
            } else {
                self.step.at((time - self.step.time) / self.step.length, &mut states);
            }
            // An input that changes at the sample has its new value there.
            Inputs::new(schema, self.task.record, sample).at(time, &mut u);
            let parameters = &self.parameters;
            let covariates = &self.task.record.covariates;
            let at = At { time, states: &states, inputs: &u, parameters, covariates };
            self.equations.output(&at, &mut channels);
            channels.iter().enumerate().for_each(|(c, &y)| store(out, self.emitted, c, y));
            self.emitted += 1;
        }
    }
}
