//! One window that is advanced by itself, with its events, state bounds and rests.
//!
//! The sensitivities are carried across discontinuities with the derivative of the time at which these occur.

use super::block::{Block, Columns, StepInputs};
use super::{Method, SimulatedEvent, SimulationError, euler, implicit, reference};
use crate::limits::MAX_EVENTS_PER_WINDOW;
use crate::system::{Column, Gradient, System};

/// Which equations hold in a window at present: sides of conditions, states at bounds, events at rest.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mode {
    /// For each event, the side of 0 (-1 or 1) on which its condition `when` is before its next crossing.
    pub(crate) sides: Vec<f64>,
    /// For each event at rest, the side of its condition before the event that led to the rest; else `None`.
    pub(super) resting: Vec<Option<f64>>,
    /// For each state, -1 at its lower bound, 1 at its upper bound, else 0.
    pub(super) bounds: Vec<i8>,
    /// For each state, whether its rate is 0 because of a bound or a rest.
    pub(super) fixed: Vec<bool>,
    /// Number of events that have fired in the window so far.
    pub(super) fired: usize,
}

/// One window that is simulated by itself, outside the block of windows.
#[derive(Debug, Clone)]
pub(crate) struct Lane {
    pub(crate) block: Block<1>,
    pub(crate) step_inputs: StepInputs<1>,
    pub(crate) mode: Mode,
    pub(crate) events: Vec<SimulatedEvent>,
    /// Length of the last step that error control chose for this window, s.
    pub(super) last_step: f64,
}

/// Why a step of a window could not be completed.
pub(crate) enum StepFailure {
    TooManyEvents(usize, f64),
    Zeno(usize, f64),
    /// A state that reaches and leaves its bound again and again, and the time.
    Chatter(usize, f64),
    NoConvergence(f64),
}

impl StepFailure {
    /// Converts the failure to the error that a user sees.
    pub(crate) fn into_error(self, system: &System, record: &str) -> SimulationError {
        let record = record.to_owned();
        let name = |event: usize| system.model.events.get(event).map_or_else(String::new, |e| e.name.clone());
        match self {
            StepFailure::TooManyEvents(event, time) => SimulationError::TooManyEvents {
                record,
                time,
                event: name(event),
                allowed: MAX_EVENTS_PER_WINDOW,
            },
            StepFailure::Zeno(event, time) => SimulationError::Zeno { record, time, event: name(event) },
            StepFailure::Chatter(state, time) => {
                let state = system.model.states.get(state).map_or_else(String::new, |s| s.name.clone());
                SimulationError::Chatter { record, time, state }
            }
            StepFailure::NoConvergence(time) => SimulationError::NoConvergence { record, time },
        }
    }
}

impl Mode {
    pub(crate) fn new(system: &System) -> Mode {
        let (events, states) = (system.model.events.len(), system.states());
        Mode {
            sides: vec![0.0; events],
            resting: vec![None; events],
            bounds: vec![0; states],
            fixed: vec![false; states],
            fired: 0,
        }
    }

    /// Whether no state of a window is at a bound and no event at rest, so that the step of the whole block is valid.
    pub(crate) fn is_free(&self) -> bool {
        self.bounds.iter().all(|w| *w == 0) && self.resting.iter().all(Option::is_none)
    }

    /// Recomputes for which states the rate is fixed at 0.
    pub(super) fn update_fixed(&mut self, system: &System) {
        for (state, fixed) in self.fixed.iter_mut().enumerate() {
            *fixed = self.bounds[state] != 0;
        }
        for (event, _) in self.resting.iter().enumerate().filter(|(_, r)| r.is_some()) {
            let event = &system.model.events[event];
            let resting_states = event.rest.iter().flat_map(|r| r.hold.iter().copied());
            resting_states
                .chain(event.set.iter().map(|(state, _)| *state))
                .for_each(|state| self.fixed[state] = true);
        }
    }
}

impl Lane {
    pub(crate) fn new(system: &System, seeds: usize, parameters: &[f64]) -> Lane {
        let mut block = Block::new(system, seeds);
        block.set_parameters(system, 0, parameters);
        block.prepare(system);
        let (step_inputs, mode) = (StepInputs::new(system.model.inputs.len()), Mode::new(system));
        Lane { block, step_inputs, mode, events: Vec::new(), last_step: 0.0 }
    }

    /// Creates a lane without a window, as a placeholder for one that was moved out.
    pub(crate) fn empty() -> Lane {
        Lane {
            block: Block::empty(),
            step_inputs: StepInputs::new(0),
            mode: Mode::default(),
            events: Vec::new(),
            last_step: 0.0,
        }
    }

    /// Computes the values of all conditions at the present state.
    pub(super) fn conditions(&mut self, system: &System, time: f64) -> Vec<f64> {
        self.block.evaluate(system, &system.conditions, &self.step_inputs, &[time]);
        let registers = &self.block.registers;
        system.conditions.results.iter().map(|r| registers[*r as usize][0]).collect()
    }

    /// Computes the rates at the present state as the equations give them, ignoring bounds and rests.
    pub(super) fn raw_rates(&mut self, system: &System, time: f64) -> Vec<f64> {
        self.block.evaluate(system, &system.rates, &self.step_inputs, &[time]);
        let registers = &self.block.registers;
        system.rates.results.iter().map(|r| registers[*r as usize][0]).collect()
    }

    /// Computes the rates at the present state; 0 for states fixed by a bound or a rest.
    pub(super) fn rates(&mut self, system: &System, time: f64) -> Vec<f64> {
        let mut rates = self.raw_rates(system, time);
        rates.iter_mut().zip(&self.mode.fixed).filter(|(_, fixed)| **fixed).for_each(|(rate, _)| *rate = 0.0);
        rates
    }

    /// Starts a window: moves initial states into their bounds, and sets the side of each condition.
    pub(crate) fn begin(&mut self, system: &System, time: f64) {
        let n = system.states();
        for (state, declared) in system.model.states.iter().enumerate() {
            let x = &mut self.block.x[state][0];
            let below = declared.min.filter(|min| *x < *min);
            if let Some(bound) = below.or(declared.max.filter(|max| *x > *max)) {
                *x = bound;
                self.block.s.iter_mut().skip(state).step_by(n).for_each(|s| s[0] = 0.0);
            }
        }
        if system.model.events.is_empty() {
            return;
        }
        let conditions = self.conditions(system, time);
        for (event, value) in conditions.into_iter().enumerate().take(system.model.events.len()) {
            let speed = if value == 0.0 { self.speed(system, event, time) } else { 0.0 };
            // On the threshold and moving through it: take the side it comes from, so that the event fires at
            // once.
            self.mode.sides[event] = if value == 0.0 { -speed.signum() } else { value.signum() };
        }
    }

    /// Scale of rounding errors of a condition at a state: the sum of the absolute terms of its derivative.
    pub(super) fn condition_scale(
        &mut self,
        system: &System,
        condition: usize,
        time: f64,
        state: &[[f64; 1]],
    ) -> f64 {
        self.block.x.copy_from_slice(state);
        let gradient = &system.condition_gradients[condition];
        self.block.evaluate(system, &gradient.section, &self.step_inputs, &[time]);
        let x: Vec<f64> = state.iter().map(|x| x[0]).collect();
        condition_speed(gradient, &self.block, &x).1
    }

    /// Change per second of an event's condition along the present rates.
    pub(super) fn speed(&mut self, system: &System, condition: usize, time: f64) -> f64 {
        let rates = self.rates(system, time);
        let gradient = &system.condition_gradients[condition];
        self.block.evaluate(system, &gradient.section, &self.step_inputs, &[time]);
        condition_speed(gradient, &self.block, &rates).0
    }

    /// Updates which states are at bounds and which events at rest, after an input may have jumped.
    pub(super) fn update_bounds_and_rests(&mut self, system: &System, time: f64) {
        let rates = self.raw_rates(system, time);
        let n = system.states();
        for (state, declared) in system.model.states.iter().enumerate() {
            let x = self.block.x[state][0];
            let rate = rates[state];
            let at_low = declared.min.is_some_and(|min| x <= min) && rate < 0.0;
            let at_high = declared.max.is_some_and(|max| x >= max) && rate > 0.0;
            match self.mode.bounds[state] {
                0 if at_low || at_high => {
                    self.mode.bounds[state] = if at_low { -1 } else { 1 };
                    self.block.s.iter_mut().skip(state).step_by(n).for_each(|s| s[0] = 0.0);
                }
                -1 if rate > 0.0 => self.mode.bounds[state] = 0,
                1 if rate < 0.0 => self.mode.bounds[state] = 0,
                _ => {}
            }
        }
        if self.mode.resting.iter().any(Option::is_some) {
            let conditions = self.conditions(system, time);
            for event in 0..self.mode.resting.len() {
                let has_ended = system.rest_ends[event].is_some_and(|until| conditions[until] > 0.0);
                if let (Some(side), true) = (self.mode.resting[event], has_ended) {
                    self.mode.resting[event] = None;
                    self.mode.sides[event] = side;
                }
            }
        }
        self.mode.update_fixed(system);
    }

    /// Advances the window by a step without looking for events.
    pub(super) fn advance(
        &mut self,
        system: &System,
        method: Method,
        (time, h): (f64, f64),
        columns: Option<&Columns>,
    ) -> Result<(), StepFailure> {
        let fixed = std::mem::take(&mut self.mode.fixed);
        let is_solved = match method {
            Method::RungeKutta | Method::UncheckedRungeKutta => {
                self.block.step(system, &self.step_inputs, (&[time], &[h]), columns, &fixed);
                true
            }
            Method::Euler { .. } => {
                let at = (&[time], &[h]);
                euler::step(&mut self.block, system, &self.step_inputs, at, columns, &fixed);
                true
            }
            Method::Implicit => {
                implicit::step(&mut self.block, system, &self.step_inputs, (time, h), columns, &fixed)
            }
            Method::Reference { tolerance } => {
                reference::step(&mut self.block, system, &self.step_inputs, (time, h), &fixed, tolerance);
                true
            }
        };
        self.mode.fixed = fixed;
        if is_solved { Ok(()) } else { Err(StepFailure::NoConvergence(time)) }
    }
}

/// Change per second of an event's condition along `rates`, and the sum of the absolute values of its terms.
pub(super) fn condition_speed(gradient: &Gradient, block: &Block<1>, rates: &[f64]) -> (f64, f64) {
    let (mut speed, mut scale) = (0.0, 0.0);
    for entry in &gradient.entries {
        let factor = match entry.column {
            Column::State(state) => rates[state],
            Column::Time => 1.0,
            Column::Active(_) => continue,
        };
        let part = block.registers[entry.register][0] * factor;
        speed += part;
        scale += part.abs();
    }
    (speed, scale)
}
