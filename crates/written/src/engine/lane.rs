//! One window where something happens: events are located, states reset, walls and rests entered and left, and the
//! sensitivities carried across with the derivative of the time at which it happens.

use super::block::{Block, Columns, Drive};
use super::{EventSeen, Method, SimulationError, implicit, reference};
use crate::limits::EVENTS_PER_WINDOW;
use crate::model::Direction;
use crate::system::{Column, Gradient, System};

/// Below this share of its usual speed a condition passes 0 so slowly that the time of the event has no derivative to
/// rely on.
const GRAZING: f64 = 1e-6;

/// A condition nearer to 0 than this share of the parts that it is made of is 0 within rounding.
const ROUNDING: f64 = 1e-12;

/// Which laws hold at present.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mode {
    /// Sign of each `when` before its next passage.
    pub(crate) sides: Vec<f64>,
    /// Side of each `when` before the event that led to rest.
    resting: Vec<Option<f64>>,
    /// By state: -1 at its lower wall, 1 at its upper, else 0.
    walls: Vec<i8>,
    /// States that stand still.
    held: Vec<bool>,
    fired: usize,
}

/// One window apart from its block.
#[derive(Debug, Clone)]
pub(crate) struct Lane {
    pub(crate) block: Block<1>,
    pub(crate) drive: Drive<1>,
    pub(crate) mode: Mode,
    pub(crate) events: Vec<EventSeen>,
    /// Length of the last step that was chosen by its error, in seconds.
    last_step: f64,
}

/// Something whose passage through 0 is watched.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Watched {
    /// `when` of an event, times the sign that makes it rise.
    Event { event: usize, sign: f64 },
    /// The end of a rest.
    Until { event: usize },
    /// A state beyond its wall.
    Wall { state: usize, side: i8 },
    /// The rate of a state at its wall, positive away from it.
    Away { state: usize, side: i8 },
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

    fn update_held(&mut self, system: &System) {
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
            block: Block::default(),
            drive: Drive::new(0),
            mode: Mode::default(),
            events: Vec::new(),
            last_step: 0.0,
        }
    }

    /// Values of all conditions at the present state.
    fn conditions(&mut self, system: &System, time: f64) -> Vec<f64> {
        self.block.evaluate(system, &system.conditions, &self.drive, &[time]);
        let registers = &self.block.registers;
        system.conditions.results.iter().map(|r| registers[*r as usize][0]).collect()
    }

    /// Rates at the present state, those of walls and rests included.
    fn raw_rates(&mut self, system: &System, time: f64) -> Vec<f64> {
        self.block.evaluate(system, &system.rates, &self.drive, &[time]);
        let registers = &self.block.registers;
        system.rates.results.iter().map(|r| registers[*r as usize][0]).collect()
    }

    fn rates(&mut self, system: &System, time: f64) -> Vec<f64> {
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
    fn size(&mut self, system: &System, condition: usize, time: f64, state: &[[f64; 1]]) -> f64 {
        self.block.x.copy_from_slice(state);
        let gradient = &system.condition_gradients[condition];
        self.block.evaluate(system, &gradient.section, &self.drive, &[time]);
        let x: Vec<f64> = state.iter().map(|x| x[0]).collect();
        rate_of(gradient, &self.block, &x).1
    }

    /// Change per second of a condition along the present rates.
    fn speed(&mut self, system: &System, condition: usize, time: f64) -> f64 {
        let rates = self.rates(system, time);
        let gradient = &system.condition_gradients[condition];
        self.block.evaluate(system, &gradient.section, &self.drive, &[time]);
        rate_of(gradient, &self.block, &rates).0
    }

    /// Enters and leaves walls and rests where an input has jumped.
    fn settle(&mut self, system: &System, time: f64) {
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
    fn advance(
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

    /// Advances over a part of an interval in steps whose error stays below `tolerance`.
    pub(crate) fn adaptive(
        &mut self,
        system: &System,
        (begin, end): (f64, f64),
        tolerance: f64,
    ) -> Result<(), Trouble> {
        let mut time = begin;
        let mut h = if self.last_step > 0.0 { self.last_step } else { 0.01 * (end - begin) };
        while time < end {
            h = h.min(end - time);
            let before = self.block.x.clone();
            let error =
                reference::step(&mut self.block, system, &self.drive, (time, h), &self.mode.held, tolerance);
            self.block.x = before;
            // The usual rule of a method of order 5 with its margin of safety (Hairer, Norsett and Wanner, II.4).
            let factor = (0.9 * error.powf(-0.2)).clamp(0.2, 5.0);
            if error > 1.0 {
                h *= factor;
                if h < 1e-14 * (end - begin) {
                    return Err(Trouble::NoConvergence(time));
                }
                continue;
            }
            self.walk(system, Method::Reference { tolerance }, (time, h), None)?;
            let is_last = time + h >= end;
            time = if is_last { end } else { time + h };
            h *= factor;
            if !is_last {
                self.last_step = h;
            }
        }
        Ok(())
    }

    /// Advances from `time` by `h`, stopping at everything that happens between.
    pub(crate) fn walk(
        &mut self,
        system: &System,
        method: Method,
        (time, h): (f64, f64),
        columns: Option<&Columns>,
    ) -> Result<(), Trouble> {
        let mut done = 0.0;
        // Everything that happens within the step uses up one round; what fires costs a place in the count of the
        // window, and walls and rests cannot alternate without one of them firing or time passing.
        for _ in 0..EVENTS_PER_WINDOW {
            let now = time + done;
            self.settle(system, now);
            let left = h - done;
            let begin = self.block.x.clone();
            self.advance(system, method, (now, left), None)?;
            let first_rate: Vec<f64> = self.block.first_rate.iter().map(|f| f[0]).collect();
            let end = self.block.x.clone();
            if !end.iter().all(|x| x[0].is_finite()) {
                return self.finish(system, method, (now, left), begin, columns);
            }
            let at_end = self.watch(system, now + left);
            let last_rate = self.rates(system, now + left);
            // The middle by the cubic through both ends with their rates.
            for i in 0..begin.len() {
                let bend = 0.125 * left * (first_rate[i] - last_rate[i]);
                self.block.x[i][0] = 0.5 * (begin[i][0] + end[i][0]) + bend;
            }
            let at_middle = self.watch(system, now + 0.5 * left);
            let mut first: Option<(f64, Watched)> = None;
            for (index, watched) in self.watched(system).into_iter().enumerate() {
                let (middle, end) = (at_middle[index], at_end[index]);
                let armed = match watched {
                    Watched::Event { event, sign } => self.mode.sides[event] * sign < 0.0,
                    _ => true,
                };
                let bracket = if armed && middle >= 0.0 {
                    Some((0.0, 0.5 * left))
                } else if (armed || middle < 0.0) && end >= 0.0 {
                    Some((if middle < 0.0 { 0.5 * left } else { 0.0 }, left))
                } else {
                    None
                };
                if let Some(bracket) = bracket {
                    let at = self.locate(system, method, (now, &begin), index, bracket)?;
                    let earlier = first.is_none_or(|(earliest, _)| at < earliest);
                    if earlier && self.is_real(system, method, watched, (now, &begin), at)? {
                        first = Some((at, watched));
                    } else if let (Watched::Event { event, .. }, true) = (watched, earlier && at == 0.0) {
                        // It moves away and is back at once: flights have become shorter than time is resolved.
                        if end > ROUNDING * self.size(system, event, now, &begin) {
                            return Err(Trouble::Endless(event, now));
                        }
                    }
                }
            }
            let Some((at, watched)) = first else {
                self.finish(system, method, (now, left), begin, columns)?;
                self.update_sides(system, time + h);
                return Ok(());
            };
            self.block.x = begin;
            self.advance(system, method, (now, at), columns)?;
            self.happen(system, now + at, watched, columns)?;
            done += at;
            if done >= h {
                return Ok(());
            }
        }
        Err(Trouble::TooManyEvents(0, time))
    }

    /// Takes a step again from `begin`, now with sensitivities.
    fn finish(
        &mut self,
        system: &System,
        method: Method,
        step: (f64, f64),
        begin: Vec<[f64; 1]>,
        columns: Option<&Columns>,
    ) -> Result<(), Trouble> {
        self.block.x = begin;
        self.advance(system, method, step, columns)
    }

    /// What is watched in the present mode, always in the same order.
    fn watched(&self, system: &System) -> Vec<Watched> {
        let mut list = Vec::new();
        for (event, declared) in system.model.events.iter().enumerate() {
            if self.mode.resting[event].is_some() {
                list.push(Watched::Until { event });
                continue;
            }
            let sign = match declared.direction {
                Direction::Rising => 1.0,
                Direction::Falling => -1.0,
                Direction::Both => -self.mode.sides[event],
            };
            list.push(Watched::Event { event, sign });
        }
        for (state, declared) in system.model.states.iter().enumerate() {
            match self.mode.walls[state] {
                0 => {
                    let sides = [(declared.min, -1), (declared.max, 1)].into_iter();
                    let there = sides.filter(|(wall, _)| wall.is_some());
                    list.extend(there.map(|(_, side)| Watched::Wall { state, side }));
                }
                side => list.push(Watched::Away { state, side }),
            }
        }
        list
    }

    /// Values of all that is watched; each happens where its value rises through 0.
    fn watch(&mut self, system: &System, time: f64) -> Vec<f64> {
        let conditions = self.conditions(system, time);
        let needs_rates = self.mode.walls.iter().any(|w| *w != 0);
        let rates = if needs_rates { self.raw_rates(system, time) } else { Vec::new() };
        let states = &system.model.states;
        let value = |watched| match watched {
            Watched::Event { event, sign } => sign * conditions[event],
            Watched::Until { event } => system.untils[event].map_or(-1.0, |until| conditions[until]),
            Watched::Wall { state, side: -1 } => states[state].min.unwrap_or(0.0) - self.block.x[state][0],
            Watched::Wall { state, .. } => self.block.x[state][0] - states[state].max.unwrap_or(0.0),
            Watched::Away { state, side } => -f64::from(side) * rates[state],
        };
        // A wall is passed beyond it, not on it: a state that leaves it begins there.
        let open = |watched, value: f64| match watched {
            Watched::Wall { .. } if value == 0.0 => -f64::MIN_POSITIVE,
            Watched::Away { .. } if value == 0.0 => -f64::MIN_POSITIVE,
            _ => value,
        };
        self.watched(system).into_iter().map(|w| open(w, value(w))).collect()
    }

    /// Time since `now` at which something watched rises through 0, to 1e-12 s: false position with the Illinois rule,
    /// halved where that is slow, on the step taken again to each trial.
    fn locate(
        &mut self,
        system: &System,
        method: Method,
        (now, begin): (f64, &[[f64; 1]]),
        index: usize,
        (mut low, mut high): (f64, f64),
    ) -> Result<f64, Trouble> {
        let tolerance = 1e-12_f64.min(1e-9 * high);
        let value = |lane: &mut Lane, at: f64| -> Result<f64, Trouble> {
            lane.block.x.copy_from_slice(begin);
            lane.advance(system, method, (now, at), None)?;
            Ok(lane.watch(system, now + at).get(index).copied().unwrap_or(0.0))
        };
        let mut below = value(self, low)?;
        let mut above = value(self, high)?;
        // Just behind an impact the condition stands at 0 within rounding, on either side: the next passage lies behind
        // some later time at which it is clear.
        let mut clear = high;
        for _ in 0..40 {
            if below < 0.0 {
                break;
            }
            clear *= 0.5;
            let found = value(self, clear)?;
            if found < 0.0 {
                (low, below) = (clear, found);
            } else {
                (high, above) = (clear, found);
            }
        }
        if below >= 0.0 {
            return Ok(low);
        }
        let mut side = 0;
        for round in 0..200 {
            if high - low <= tolerance || above <= 0.0 {
                break;
            }
            let secant = high - above * (high - low) / (above - below);
            let inside = secant > low && secant < high && round % 8 != 7;
            let at = if inside { secant } else { 0.5 * (low + high) };
            if at <= low || at >= high {
                break;
            }
            let found = value(self, at)?;
            if found >= 0.0 {
                (high, above) = (at, found);
                below *= if side == 1 { 0.5 } else { 1.0 };
                side = 1;
            } else {
                (low, below) = (at, found);
                above *= if side == -1 { 0.5 } else { 1.0 };
                side = -1;
            }
        }
        Ok(high)
    }

    /// Whether a condition really rises there: after an impact it stands at 0 within rounding while it moves away.
    fn is_real(
        &mut self,
        system: &System,
        method: Method,
        watched: Watched,
        (now, begin): (f64, &[[f64; 1]]),
        at: f64,
    ) -> Result<bool, Trouble> {
        let Watched::Event { event, sign } = watched else { return Ok(true) };
        self.block.x.copy_from_slice(begin);
        self.advance(system, method, (now, at), None)?;
        Ok(sign * self.speed(system, event, now + at) > 0.0)
    }

    fn update_sides(&mut self, system: &System, time: f64) {
        let conditions = self.conditions(system, time);
        for event in 0..self.mode.sides.len() {
            if conditions[event] != 0.0 && self.mode.resting[event].is_none() {
                self.mode.sides[event] = conditions[event].signum();
            }
        }
    }

    /// Carries state and sensitivities across what happens at `time`.
    fn happen(
        &mut self,
        system: &System,
        time: f64,
        watched: Watched,
        columns: Option<&Columns>,
    ) -> Result<(), Trouble> {
        let n = system.states();
        let before = self.rates(system, time);
        let seeds = columns.map_or(0, |c| c.seeds.len());
        // Derivative of the time of the event with respect to each seed.
        let mut shifts = vec![0.0; seeds];
        match watched {
            Watched::Event { event, .. } => {
                let side = self.mode.sides[event];
                let (speed, usual, slopes) = self.passage(system, event, time, &before, columns);
                shifts.iter_mut().zip(slopes).for_each(|(shift, slope)| *shift = -slope / speed);
                let gradient = &system.resets[event];
                self.block.evaluate(system, &gradient.section, &self.drive, &[time]);
                let mut reset: Vec<f64> =
                    (0..n).map(|i| self.block.registers[gradient.section.results[i] as usize][0]).collect();
                let mut moved = vec![0.0; n];
                let mut carried = self.block.s.clone();
                for seed in 0..seeds {
                    let Some(columns) = columns else { break };
                    // S seen at the moved time of the event, then through the reset.
                    let column = &mut self.block.s[seed * n..][..n];
                    column.iter_mut().zip(&before).for_each(|(s, f)| s[0] += f * shifts[seed]);
                    self.block.along(gradient, columns, seed, 0, &mut moved);
                    let time_share = gradient.entries.iter().filter(|e| e.column == Column::Time);
                    time_share
                        .for_each(|e| moved[e.row] += self.block.registers[e.register][0] * shifts[seed]);
                    carried[seed * n..][..n].iter_mut().zip(&moved).for_each(|(to, m)| to[0] = *m);
                }
                self.block.s = carried;
                (0..n).for_each(|i| self.block.x[i][0] = reset[i]);
                self.mode.fired += 1;
                let rests = self.comes_to_rest(system, event, time, side, &mut reset);
                if rests {
                    let set = system.model.events[event].set.iter().map(|(state, _)| *state);
                    for state in
                        set.filter(|s| !system.model.events[event].rest.iter().any(|r| r.hold.contains(s)))
                    {
                        self.block.x[state][0] = 0.0;
                        self.block.s.iter_mut().skip(state).step_by(n).for_each(|s| s[0] = 0.0);
                    }
                }
                let grazing = speed.abs() < GRAZING * usual;
                self.events.push(EventSeen { event, time, grazing, rests });
                if self.mode.fired > EVENTS_PER_WINDOW {
                    return Err(Trouble::TooManyEvents(event, time));
                }
                self.learn_sides(system, event, time);
            }
            Watched::Until { event } => {
                if let Some(until) = system.untils[event] {
                    let (speed, _, slopes) = self.passage(system, until, time, &before, columns);
                    shifts.iter_mut().zip(slopes).for_each(|(shift, slope)| *shift = -slope / speed);
                }
                self.shift(&before, &shifts, 1.0);
                if let Some(side) = self.mode.resting[event].take() {
                    self.mode.sides[event] = side;
                }
                self.mode.update_held(system);
            }
            Watched::Wall { state, side } => {
                let declared = &system.model.states[state];
                for (seed, shift) in shifts.iter_mut().enumerate() {
                    *shift = -self.block.s[seed * n + state][0] / before[state];
                }
                self.shift(&before, &shifts, 1.0);
                self.block.x[state][0] =
                    if side < 0 { declared.min } else { declared.max }.unwrap_or(self.block.x[state][0]);
                self.block.s.iter_mut().skip(state).step_by(n).for_each(|s| s[0] = 0.0);
                self.mode.walls[state] = side;
                self.mode.update_held(system);
            }
            Watched::Away { state, .. } => {
                // The rate is 0 as it turns, so that nothing jumps and the time of it does not matter.
                self.mode.walls[state] = 0;
                self.mode.update_held(system);
                return Ok(());
            }
        }
        let after = self.rates(system, time);
        self.shift(&after, &shifts, -1.0);
        Ok(())
    }

    /// S += sign f tau', for each seed.
    fn shift(&mut self, rates: &[f64], shifts: &[f64], sign: f64) {
        for (column, shift) in self.block.s.chunks_exact_mut(rates.len()).zip(shifts) {
            column.iter_mut().zip(rates).for_each(|(s, f)| s[0] += sign * f * shift);
        }
    }

    /// Speed of a condition, the usual size of that speed, and the condition's derivative for each seed.
    fn passage(
        &mut self,
        system: &System,
        condition: usize,
        time: f64,
        rates: &[f64],
        columns: Option<&Columns>,
    ) -> (f64, f64, Vec<f64>) {
        let gradient = &system.condition_gradients[condition];
        self.block.evaluate(system, &gradient.section, &self.drive, &[time]);
        let (speed, usual) = rate_of(gradient, &self.block, rates);
        let mut slope = [0.0];
        let mut slopes = Vec::new();
        for seed in 0..columns.map_or(0, |c| c.seeds.len()) {
            if let Some(columns) = columns {
                self.block.along(gradient, columns, seed, 0, &mut slope);
            }
            slopes.push(slope[0]);
        }
        (speed, usual, slopes)
    }

    /// Begins the rest of an event whose condition now moves too slowly, unless the rest would end at once.
    fn comes_to_rest(
        &mut self,
        system: &System,
        event: usize,
        time: f64,
        side: f64,
        reset: &mut [f64],
    ) -> bool {
        let Some(rest) = &system.model.events[event].rest else { return false };
        let speed = self.speed(system, event, time);
        let exhausted = self.mode.fired >= EVENTS_PER_WINDOW;
        if speed.abs() >= rest.below && !exhausted {
            return false;
        }
        let set = system.model.events[event].set.iter().map(|(state, _)| *state);
        for state in set.filter(|s| !rest.hold.contains(s)) {
            self.block.x[state][0] = 0.0;
        }
        let conditions = self.conditions(system, time);
        let ends = system.untils[event].is_some_and(|until| conditions[until] > 0.0);
        if ends {
            (0..reset.len()).for_each(|i| self.block.x[i][0] = reset[i]);
            return false;
        }
        self.mode.resting[event] = Some(side);
        self.mode.update_held(system);
        true
    }

    /// Sides after an event: of its own condition by the way it moves, of the others by their values.
    fn learn_sides(&mut self, system: &System, event: usize, time: f64) {
        let speed = self.speed(system, event, time);
        let conditions = self.conditions(system, time);
        for (other, side) in self.mode.sides.iter_mut().enumerate() {
            if other == event {
                if speed != 0.0 {
                    *side = speed.signum();
                }
            } else if conditions[other] != 0.0 {
                *side = conditions[other].signum();
            }
        }
    }
}

/// Change per second of a condition along `rates`, and the sum of the sizes of its parts.
fn rate_of(gradient: &Gradient, block: &Block<1>, rates: &[f64]) -> (f64, f64) {
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
