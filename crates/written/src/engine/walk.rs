//! A step of one window that stops at everything that happens within it.

use super::block::Columns;
use super::lane::{Lane, Trouble};
use super::rows::Rows;
use super::{Method, reference};
use crate::limits::EVENTS_PER_WINDOW;
use crate::model::Direction;
use crate::system::System;

/// A condition nearer to 0 than this share of the parts that it is made of is 0 within rounding.
const ROUNDING: f64 = 1e-12;

/// Something whose passage through 0 is watched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Watched {
    /// `when` of an event, times the sign that makes it rise.
    Event { event: usize, sign: f64 },
    /// The end of a rest.
    Until { event: usize },
    /// A state beyond its wall.
    Wall { state: usize, side: i8 },
    /// The rate of a state at its wall, positive away from it.
    Away { state: usize, side: i8 },
}

impl Lane {
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
    pub(super) fn finish(
        &mut self,
        system: &System,
        method: Method,
        step: (f64, f64),
        begin: Rows<1>,
        columns: Option<&Columns>,
    ) -> Result<(), Trouble> {
        self.block.x = begin;
        self.advance(system, method, step, columns)
    }

    /// Conditions that are watched in the present mode, always in the same order.
    pub(super) fn watched(&self, system: &System) -> Vec<Watched> {
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
    pub(super) fn watch(&mut self, system: &System, time: f64) -> Vec<f64> {
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
    pub(super) fn locate(
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
    pub(super) fn is_real(
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

    pub(super) fn update_sides(&mut self, system: &System, time: f64) {
        let conditions = self.conditions(system, time);
        let modes = self.mode.sides.iter_mut().zip(&self.mode.resting);
        for ((side, resting), condition) in modes.zip(conditions) {
            if condition != 0.0 && resting.is_none() {
                *side = condition.signum();
            }
        }
    }
}
