//! A step of one window that stops at every discontinuity within it.
//!
//! Each trigger (possible cause of a discontinuity) is a value that rises through 0. It is checked in the
//! middle and at the end of the step; a change of sign is located by repeating the step with shorter lengths.

use super::block::Columns;
use super::lane::{Lane, StepFailure};
use super::rows::Rows;
use super::{Method, reference};
use crate::limits::MAX_EVENTS_PER_WINDOW;
use crate::model::Direction;
use crate::system::System;

/// Share of its scale below which the value of a condition counts as 0 within rounding.
const ROUNDING_RATIO: f64 = 1e-12;

/// Maximum number of times that bounds are reached or left in one step.
///
/// Steps resolve the rates, so that a state reaches and leaves its bound about once in a step. More often means that the
/// rates turn at the bound: the state would be moved back to it again and again, without end.
const MAX_BOUND_CROSSINGS_PER_STEP: usize = 16;

/// A cause of a discontinuity, which occurs where the trigger's value rises through 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Trigger {
    /// The condition `when` of an event crosses 0; `sign` makes the crossing a rise.
    Event { event: usize, sign: f64 },
    /// The condition that ends the rest of an event becomes true.
    RestEnd { event: usize },
    /// A state reaches its bound: `side` -1 for the lower, 1 for the upper one.
    BoundReached { state: usize, side: i8 },
    /// The rate of a state at its bound turns away from the bound.
    BoundLeft { state: usize, side: i8 },
}

impl Lane {
    /// Advances over a part of a sample interval in steps whose error stays below `tolerance`.
    pub(crate) fn advance_adaptively(
        &mut self,
        system: &System,
        (begin, end): (f64, f64),
        tolerance: f64,
    ) -> Result<(), StepFailure> {
        let mut time = begin;
        let mut h = if self.last_step > 0.0 { self.last_step } else { 0.01 * (end - begin) };
        while time < end {
            h = h.min(end - time);
            let before = self.block.x.clone();
            let error = reference::step(
                &mut self.block,
                system,
                &self.step_inputs,
                (time, h),
                &self.mode.fixed,
                tolerance,
            );
            self.block.x = before;
            // Step size control for order 5 with safety factor 0.9 (Hairer, Norsett and Wanner, section
            // II.4).
            let factor = (0.9 * error.powf(-0.2)).clamp(0.2, 5.0);
            if error > 1.0 {
                h *= factor;
                if h < 1e-14 * (end - begin) {
                    return Err(StepFailure::NoConvergence(time));
                }
                continue;
            }
            self.step_through_events(system, Method::Reference { tolerance }, (time, h), None)?;
            let is_last = time + h >= end;
            time = if is_last { end } else { time + h };
            h *= factor;
            if !is_last {
                self.last_step = h;
            }
        }
        Ok(())
    }

    /// Advances the window from `time` by `h` (s), stopping at every discontinuity.
    pub(crate) fn step_through_events(
        &mut self,
        system: &System,
        method: Method,
        (time, h): (f64, f64),
        columns: Option<&Columns>,
    ) -> Result<(), StepFailure> {
        let (mut done, mut crossings) = (0.0, 0);
        // Each round handles one discontinuity. Every event counts towards the limit of the window, and every
        // bound that is reached or left towards that of the step.
        for _ in 0..MAX_EVENTS_PER_WINDOW {
            let now = time + done;
            self.update_bounds_and_rests(system, now);
            let remaining = h - done;
            let begin = self.block.x.clone();
            self.advance(system, method, (now, remaining), None)?;
            let first_rate: Vec<f64> = self.block.first_rate.iter().map(|f| f[0]).collect();
            let end = self.block.x.clone();
            if !end.iter().all(|x| x[0].is_finite()) {
                return self.repeat_step(system, method, (now, remaining), begin, columns);
            }
            let at_end = self.trigger_values(system, now + remaining);
            let last_rate = self.rates(system, now + remaining);
            // The state in the middle, by the cubic through both ends with their rates.
            for i in 0..begin.len() {
                let bend = 0.125 * remaining * (first_rate[i] - last_rate[i]);
                self.block.x[i][0] = 0.5 * (begin[i][0] + end[i][0]) + bend;
            }
            let at_middle = self.trigger_values(system, now + 0.5 * remaining);
            let mut first: Option<(f64, Trigger)> = None;
            for (index, trigger) in self.triggers(system).into_iter().enumerate() {
                let (middle, end) = (at_middle[index], at_end[index]);
                let armed = match trigger {
                    Trigger::Event { event, sign } => self.mode.sides[event] * sign < 0.0,
                    _ => true,
                };
                let bracket = if armed && middle >= 0.0 {
                    Some((0.0, 0.5 * remaining))
                } else if (armed || middle < 0.0) && end >= 0.0 {
                    Some((if middle < 0.0 { 0.5 * remaining } else { 0.0 }, remaining))
                } else {
                    None
                };
                if let Some(bracket) = bracket {
                    let event_time = self.locate(system, method, (now, &begin), index, bracket)?;
                    let earlier = first.is_none_or(|(earliest, _)| event_time < earliest);
                    if earlier && self.is_true_crossing(system, method, trigger, (now, &begin), event_time)? {
                        first = Some((event_time, trigger));
                    } else if let (Trigger::Event { event, .. }, true) =
                        (trigger, earlier && event_time == 0.0)
                    {
                        // The event moves away and is back at once: its intervals are shorter than the
                        // resolution of time.
                        if end > ROUNDING_RATIO * self.condition_scale(system, event, now, &begin) {
                            return Err(StepFailure::Zeno(event, now));
                        }
                    }
                }
            }
            let Some((event_time, trigger)) = first else {
                self.repeat_step(system, method, (now, remaining), begin, columns)?;
                self.update_sides(system, time + h);
                return Ok(());
            };
            self.block.x = begin;
            self.advance(system, method, (now, event_time), columns)?;
            self.cross_discontinuity(system, now + event_time, trigger, columns)?;
            if let Trigger::BoundReached { state, .. } | Trigger::BoundLeft { state, .. } = trigger {
                crossings += 1;
                if crossings > MAX_BOUND_CROSSINGS_PER_STEP {
                    return Err(StepFailure::Chatter(state, now + event_time));
                }
            }
            done += event_time;
            if done >= h {
                return Ok(());
            }
        }
        Err(StepFailure::TooManyEvents(0, time))
    }

    /// Repeats a step from the saved state `begin`, now with sensitivities.
    pub(super) fn repeat_step(
        &mut self,
        system: &System,
        method: Method,
        step: (f64, f64),
        begin: Rows<1>,
        columns: Option<&Columns>,
    ) -> Result<(), StepFailure> {
        self.block.x = begin;
        self.advance(system, method, step, columns)
    }

    /// Lists the triggers that are possible in the present mode, always in the same order.
    pub(super) fn triggers(&self, system: &System) -> Vec<Trigger> {
        let mut list = Vec::new();
        for (event, declared) in system.model.events.iter().enumerate() {
            if self.mode.resting[event].is_some() {
                list.push(Trigger::RestEnd { event });
                continue;
            }
            let sign = match declared.direction {
                Direction::Rising => 1.0,
                Direction::Falling => -1.0,
                Direction::Both => -self.mode.sides[event],
            };
            list.push(Trigger::Event { event, sign });
        }
        for (state, declared) in system.model.states.iter().enumerate() {
            match self.mode.bounds[state] {
                0 => {
                    let sides = [(declared.min, -1), (declared.max, 1)].into_iter();
                    let existing = sides.filter(|(bound, _)| bound.is_some());
                    list.extend(existing.map(|(_, side)| Trigger::BoundReached { state, side }));
                }
                side => list.push(Trigger::BoundLeft { state, side }),
            }
        }
        list
    }

    /// Computes the values of all triggers; each trigger occurs where its value rises through 0.
    pub(super) fn trigger_values(&mut self, system: &System, time: f64) -> Vec<f64> {
        let conditions = self.conditions(system, time);
        let needs_rates = self.mode.bounds.iter().any(|w| *w != 0);
        let rates = if needs_rates { self.raw_rates(system, time) } else { Vec::new() };
        let states = &system.model.states;
        let value = |trigger| match trigger {
            Trigger::Event { event, sign } => sign * conditions[event],
            Trigger::RestEnd { event } => system.rest_ends[event].map_or(-1.0, |until| conditions[until]),
            Trigger::BoundReached { state, side: -1 } => {
                states[state].min.unwrap_or(0.0) - self.block.x[state][0]
            }
            Trigger::BoundReached { state, .. } => self.block.x[state][0] - states[state].max.unwrap_or(0.0),
            Trigger::BoundLeft { state, side } => -f64::from(side) * rates[state],
        };
        // A bound counts as passed only beyond it: a state that leaves the bound starts exactly on it.
        let exclude_zero = |trigger, value: f64| match trigger {
            Trigger::BoundReached { .. } if value == 0.0 => -f64::MIN_POSITIVE,
            Trigger::BoundLeft { .. } if value == 0.0 => -f64::MIN_POSITIVE,
            _ => value,
        };
        self.triggers(system).into_iter().map(|w| exclude_zero(w, value(w))).collect()
    }

    /// Locates the time after `now` at which the value of a trigger rises through 0, to 1e-12 s.
    ///
    /// False position with the Illinois rule, and bisection every eighth round; the step is repeated up to
    /// each trial time.
    pub(super) fn locate(
        &mut self,
        system: &System,
        method: Method,
        (now, begin): (f64, &[[f64; 1]]),
        index: usize,
        (mut low, mut high): (f64, f64),
    ) -> Result<f64, StepFailure> {
        let tolerance = 1e-12_f64.min(1e-9 * high);
        let value = |lane: &mut Lane, trial_time: f64| -> Result<f64, StepFailure> {
            lane.block.x.copy_from_slice(begin);
            lane.advance(system, method, (now, trial_time), None)?;
            Ok(lane.trigger_values(system, now + trial_time).get(index).copied().unwrap_or(0.0))
        };
        let mut below = value(self, low)?;
        let mut above = value(self, high)?;
        // Directly after an impact the condition is 0 within rounding, on either side. Halve the interval
        // until the value is clearly below 0; the next crossing is after that time.
        let mut clear = high;
        for _ in 0..40 {
            if below < 0.0 {
                break;
            }
            clear *= 0.5;
            let trial_value = value(self, clear)?;
            if trial_value < 0.0 {
                (low, below) = (clear, trial_value);
            } else {
                (high, above) = (clear, trial_value);
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
            let trial_time = if inside { secant } else { 0.5 * (low + high) };
            if trial_time <= low || trial_time >= high {
                break;
            }
            let found = value(self, trial_time)?;
            if found >= 0.0 {
                (high, above) = (trial_time, found);
                below *= if side == 1 { 0.5 } else { 1.0 };
                side = 1;
            } else {
                (low, below) = (trial_time, found);
                above *= if side == -1 { 0.5 } else { 1.0 };
                side = -1;
            }
        }
        Ok(high)
    }

    /// Whether the condition of an event really rises at this time.
    ///
    /// Directly after an impact the condition is 0 within rounding while it moves away.
    pub(super) fn is_true_crossing(
        &mut self,
        system: &System,
        method: Method,
        trigger: Trigger,
        (now, begin): (f64, &[[f64; 1]]),
        at: f64,
    ) -> Result<bool, StepFailure> {
        let Trigger::Event { event, sign } = trigger else { return Ok(true) };
        self.block.x.copy_from_slice(begin);
        self.advance(system, method, (now, at), None)?;
        Ok(sign * self.speed(system, event, now + at) > 0.0)
    }

    /// Updates on which side of 0 each condition is, except conditions that are 0 and those of events at rest.
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
