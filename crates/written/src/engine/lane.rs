//! One window where something happens: events are located, states reset, walls and rests entered and left, and the
//! sensitivities carried across with the derivative of the time at which it happens.

use super::block::{Block, Columns, Drive};
use super::{EventSeen, Method, SimulationError, implicit, reference};
use crate::limits::EVENTS_PER_WINDOW;
use crate::system::{Column, Gradient, System};

/// Which laws hold at present.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mode {
    /// Sign of each `when` before its next passage.
    pub(crate) sides: Vec<f64>,
    /// Side of each `when` before the event that led to rest.
    pub(super) resting: Vec<Option<f64>>,
    /// For each state -1 at its lower wall, 1 at its upper, else 0.
    pub(super) walls: Vec<i8>,
    /// States that stand still.
    pub(super) held: Vec<bool>,
    pub(super) fired: usize,
}

/// One window apart from its block.
#[derive(Debug, Clone)]
pub(crate) struct Lane {
    pub(crate) block: Block<1>,
    pub(crate) drive: Drive<1>,
    pub(crate) mode: Mode,
    pub(crate) events: Vec<EventSeen>,
    /// Length of the last step that was chosen by its error, in seconds.
    pub(super) last_step: f64,
}

/// Why a step has no end.
pub(crate) enum Trouble {
    TooManyEvents(usize, f64),
    Endless(usize, f64),
    NoConvergence(f64),
}

impl Trouble {
    pub(crate) fn of(self, system: &System, record: &str) -> SimulationError {
        let record = record.to_owned();
        let name = |event: usize| system.model.events.get(event).map_or_else(String::new, |e| e.name.clone());
        match self {
            Trouble::TooManyEvents(event, time) => SimulationError::TooManyEvents {
                record,
                time,
                event: name(event),
                allowed: EVENTS_PER_WINDOW,
            },
            Trouble::Endless(event, time) => SimulationError::Endless { record, time, event: name(event) },
            Trouble::NoConvergence(time) => SimulationError::NoConvergence { record, time },
        }
    }
}

impl Mode {
    pub(crate) fn new(system: &System) -> Mode {
        let (events, states) = (system.model.events.len(), system.states());
        Mode {
            sides: vec![0.0; events],
            resting: vec![None; events],
            walls: vec![0; states],
            held: vec![false; states],
            fired: 0,
        }
    }

    /// Whether no wall is touched and nothing rests, so that the block's own step is right.
    pub(crate) fn is_free(&self) -> bool {
        self.walls.iter().all(|w| *w == 0) && self.resting.iter().all(Option::is_none)
    }

    pub(super) fn update_held(&mut self, system: &System) {
        for (state, held) in self.held.iter_mut().enumerate() {
            *held = self.walls[state] != 0;
        }
        for (event, _) in self.resting.iter().enumerate().filter(|(_, r)| r.is_some()) {
            let event = &system.model.events[event];
            let stands = event.rest.iter().flat_map(|r| r.hold.iter().copied());
            stands.chain(event.set.iter().map(|(state, _)| *state)).for_each(|state| self.held[state] = true);
        }
    }
}

impl Lane {
    pub(crate) fn new(system: &System, seeds: usize, parameters: &[f64]) -> Lane {
        let mut block = Block::new(system, seeds);
        block.set_parameters(system, 0, parameters);
        block.prepare(system);
        let (drive, mode) = (Drive::new(system.model.inputs.len()), Mode::new(system));
        Lane { block, drive, mode, events: Vec::new(), last_step: 0.0 }
    }

    /// Stands in the place of a lane that was taken out.
    pub(crate) fn empty() -> Lane {
        Lane {
            block: Block::empty(),
            drive: Drive::new(0),
            mode: Mode::default(),
            events: Vec::new(),
            last_step: 0.0,
        }
    }

    /// Values of all conditions at the present state.
    pub(super) fn conditions(&mut self, system: &System, time: f64) -> Vec<f64> {
        self.block.evaluate(system, &system.conditions, &self.drive, &[time]);
        let registers = &self.block.registers;
        system.conditions.results.iter().map(|r| registers[*r as usize][0]).collect()
    }

    /// Rates at the present state, those of walls and rests included.
    pub(super) fn raw_rates(&mut self, system: &System, time: f64) -> Vec<f64> {
        self.block.evaluate(system, &system.rates, &self.drive, &[time]);
        let registers = &self.block.registers;
        system.rates.results.iter().map(|r| registers[*r as usize][0]).collect()
    }

    pub(super) fn rates(&mut self, system: &System, time: f64) -> Vec<f64> {
        let mut rates = self.raw_rates(system, time);
        rates.iter_mut().zip(&self.mode.held).filter(|(_, held)| **held).for_each(|(rate, _)| *rate = 0.0);
        rates
    }

    /// Begins a window: a start beyond a wall is put onto it, and each condition learns its side.
    pub(crate) fn begin(&mut self, system: &System, time: f64) {
        let n = system.states();
        for (state, declared) in system.model.states.iter().enumerate() {
            let x = &mut self.block.x[state][0];
            let low = declared.min.filter(|min| *x < *min);
            if let Some(wall) = low.or(declared.max.filter(|max| *x > *max)) {
                *x = wall;
                self.block.s.iter_mut().skip(state).step_by(n).for_each(|s| s[0] = 0.0);
            }
        }
        if system.model.events.is_empty() {
            return;
        }
        let conditions = self.conditions(system, time);
        for (event, value) in conditions.into_iter().enumerate().take(system.model.events.len()) {
            let speed = if value == 0.0 { self.speed(system, event, time) } else { 0.0 };
            // On the threshold and moving through it: the side it comes from, so that it fires at once.
            self.mode.sides[event] = if value == 0.0 { -speed.signum() } else { value.signum() };
        }
    }

    /// Size of the parts that a condition is made of, at a state.
    pub(super) fn size(&mut self, system: &System, condition: usize, time: f64, state: &[[f64; 1]]) -> f64 {
        self.block.x.copy_from_slice(state);
        let gradient = &system.condition_gradients[condition];
        self.block.evaluate(system, &gradient.section, &self.drive, &[time]);
        let x: Vec<f64> = state.iter().map(|x| x[0]).collect();
        rate_of(gradient, &self.block, &x).1
    }

    /// Change per second of a condition along the present rates.
    pub(super) fn speed(&mut self, system: &System, condition: usize, time: f64) -> f64 {
        let rates = self.rates(system, time);
        let gradient = &system.condition_gradients[condition];
        self.block.evaluate(system, &gradient.section, &self.drive, &[time]);
        rate_of(gradient, &self.block, &rates).0
    }

    /// Enters and leaves walls and rests where an input has jumped.
    pub(super) fn settle(&mut self, system: &System, time: f64) {
        let rates = self.raw_rates(system, time);
        let n = system.states();
        for (state, declared) in system.model.states.iter().enumerate() {
            let x = self.block.x[state][0];
            let rate = rates[state];
            let at_low = declared.min.is_some_and(|min| x <= min) && rate < 0.0;
            let at_high = declared.max.is_some_and(|max| x >= max) && rate > 0.0;
            match self.mode.walls[state] {
                0 if at_low || at_high => {
                    self.mode.walls[state] = if at_low { -1 } else { 1 };
                    self.block.s.iter_mut().skip(state).step_by(n).for_each(|s| s[0] = 0.0);
                }
                -1 if rate > 0.0 => self.mode.walls[state] = 0,
                1 if rate < 0.0 => self.mode.walls[state] = 0,
                _ => {}
            }
        }
        if self.mode.resting.iter().any(Option::is_some) {
            let conditions = self.conditions(system, time);
            for event in 0..self.mode.resting.len() {
                let ends = system.untils[event].is_some_and(|until| conditions[until] > 0.0);
                if let (Some(side), true) = (self.mode.resting[event], ends) {
                    self.mode.resting[event] = None;
                    self.mode.sides[event] = side;
                }
            }
        }
        self.mode.update_held(system);
    }

    /// Advances by `h` without looking for events.
    pub(super) fn advance(
        &mut self,
        system: &System,
        method: Method,
        (time, h): (f64, f64),
        columns: Option<&Columns>,
    ) -> Result<(), Trouble> {
        let held = std::mem::take(&mut self.mode.held);
        let done = match method {
            Method::RungeKutta => {
                self.block.step(system, &self.drive, (&[time], &[h]), columns, &held);
                true
            }
            Method::Implicit => {
                implicit::step(&mut self.block, system, &self.drive, (time, h), columns, &held)
            }
            Method::Reference { tolerance } => {
                reference::step(&mut self.block, system, &self.drive, (time, h), &held, tolerance);
                true
            }
        };
        self.mode.held = held;
        if done { Ok(()) } else { Err(Trouble::NoConvergence(time)) }
    }
}

/// Change per second of a condition along `rates`, and the sum of the sizes of its parts.
pub(super) fn rate_of(gradient: &Gradient, block: &Block<1>, rates: &[f64]) -> (f64, f64) {
    let (mut speed, mut usual) = (0.0, 0.0);
    for entry in &gradient.entries {
        let factor = match entry.column {
            Column::State(state) => rates[state],
            Column::Time => 1.0,
            Column::Active(_) => continue,
        };
        let part = block.registers[entry.register][0] * factor;
        speed += part;
        usual += part.abs();
    }
    (speed, usual)
}
