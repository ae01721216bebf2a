//! Carries state and sensitivities across an event, the end of a rest, or reaching a state bound.
//!
//! With the condition `g(x, t)`, the reset `R(x, p, t)`, and the rates `f-` before and `f+` after the
//! discontinuity, its time moves with a parameter by (1), and the sensitivities `S = dx/dp` jump by (2)
//! (Rozenwasser 1967):
//!
//! 1. `tau' = -(g_x S + g_p) / (g_x f- + g_t)`
//! 2. `S+ = R_x (S + f- tau') + R_p + R_t tau' - f+ tau'`

use super::SimulatedEvent;
use super::block::Columns;
use super::event_step::Trigger;
use super::lane::{Lane, StepFailure, condition_speed};
use crate::limits::MAX_EVENTS_PER_WINDOW;
use crate::system::{Column, System};

/// Share of a condition's typical speed below which a zero crossing counts as grazing (barely touching).
///
/// At a grazing crossing the derivative of the time of the event, formula (1), is not reliable.
const GRAZING_SPEED_RATIO: f64 = 1e-6;

impl Lane {
    /// Carries states and sensitivities across the discontinuity that `trigger` causes at `time`, s.
    pub(super) fn cross_discontinuity(
        &mut self,
        system: &System,
        time: f64,
        trigger: Trigger,
        columns: Option<&Columns>,
    ) -> Result<(), StepFailure> {
        let n = system.states();
        let rates_before = self.rates(system, time);
        let seeds = columns.map_or(0, |c| c.seeds.len());
        // Formula (1), per seed.
        let mut shifts = vec![0.0; seeds];
        match trigger {
            Trigger::Event { event, .. } => {
                self.fire_event(system, event, time, &rates_before, columns, &mut shifts)?;
            }
            Trigger::RestEnd { event } => {
                if let Some(until) = system.rest_ends[event] {
                    let (speed, _, slopes) = self.crossing(system, until, time, &rates_before, columns);
                    shifts.iter_mut().zip(slopes).for_each(|(shift, slope)| *shift = -slope / speed);
                }
                self.shift_sensitivities(&rates_before, &shifts, 1.0);
                if let Some(side) = self.mode.resting[event].take() {
                    self.mode.sides[event] = side;
                }
                self.mode.update_fixed(system);
            }
            Trigger::BoundReached { state, side } => {
                let declared = &system.model.states[state];
                for (seed, shift) in shifts.iter_mut().enumerate() {
                    *shift = -self.block.s[seed * n + state][0] / rates_before[state];
                }
                self.shift_sensitivities(&rates_before, &shifts, 1.0);
                self.block.x[state][0] =
                    if side < 0 { declared.min } else { declared.max }.unwrap_or(self.block.x[state][0]);
                self.block.s.iter_mut().skip(state).step_by(n).for_each(|s| s[0] = 0.0);
                self.mode.bounds[state] = side;
                self.mode.update_fixed(system);
            }
            Trigger::BoundLeft { state, .. } => {
                // The rate passes 0 there, so that nothing jumps and the exact time does not matter.
                self.mode.bounds[state] = 0;
                self.mode.update_fixed(system);
                return Ok(());
            }
        }
        let rates_after = self.rates(system, time);
        self.shift_sensitivities(&rates_after, &shifts, -1.0);
        Ok(())
    }

    /// Applies the reset of an event and starts the event's rest if it is due.
    ///
    /// Sets `shifts` to the derivatives of the event's time, formula (1), one per seed.
    fn fire_event(
        &mut self,
        system: &System,
        event: usize,
        time: f64,
        rates_before: &[f64],
        columns: Option<&Columns>,
        shifts: &mut [f64],
    ) -> Result<(), StepFailure> {
        let n = system.states();
        let side = self.mode.sides[event];
        let (speed, typical_speed, slopes) = self.crossing(system, event, time, rates_before, columns);
        shifts.iter_mut().zip(slopes).for_each(|(shift, slope)| *shift = -slope / speed);
        let gradient = &system.resets[event];
        self.block.evaluate(system, &gradient.section, &self.step_inputs, &[time]);
        let mut reset: Vec<f64> =
            (0..n).map(|i| self.block.registers[gradient.section.results[i] as usize][0]).collect();
        let mut moved = vec![0.0; n];
        let mut carried = self.block.s.clone();
        for seed in 0..shifts.len() {
            let Some(columns) = columns else { break };
            // Formula (2): the sensitivities at the moved time of the event, then through the reset.
            let column = &mut self.block.s[seed * n..][..n];
            column.iter_mut().zip(rates_before).for_each(|(s, f)| s[0] += f * shifts[seed]);
            self.block.directional_derivatives(gradient, columns, seed, 0, &mut moved);
            let time_terms = gradient.entries.iter().filter(|e| e.column == Column::Time);
            time_terms.for_each(|e| moved[e.row] += self.block.registers[e.register][0] * shifts[seed]);
            carried[seed * n..][..n].iter_mut().zip(&moved).for_each(|(to, m)| to[0] = *m);
        }
        self.block.s = carried;
        (0..n).for_each(|i| self.block.x[i][0] = reset[i]);
        self.mode.fired += 1;
        let begins_rest = self.try_to_rest(system, event, time, side, &mut reset);
        if begins_rest {
            let declared = &system.model.events[event];
            let set = declared.set.iter().map(|(state, _)| *state);
            for state in set.filter(|s| !declared.rest.iter().any(|r| r.hold.contains(s))) {
                self.block.x[state][0] = 0.0;
                self.block.s.iter_mut().skip(state).step_by(n).for_each(|s| s[0] = 0.0);
            }
        }
        let is_grazing = speed.abs() < GRAZING_SPEED_RATIO * typical_speed;
        self.events.push(SimulatedEvent { event, time, is_grazing, begins_rest });
        if self.mode.fired > MAX_EVENTS_PER_WINDOW {
            return Err(StepFailure::TooManyEvents(event, time));
        }
        self.update_sides_after_event(system, event, time);
        Ok(())
    }

    /// Adds `sign f tau'` to the sensitivities for each seed: `f` are `rates`, `tau'` are `shifts` (formula 2).
    pub(super) fn shift_sensitivities(&mut self, rates: &[f64], shifts: &[f64], sign: f64) {
        for (column, shift) in self.block.s.chunks_exact_mut(rates.len()).zip(shifts) {
            column.iter_mut().zip(rates).for_each(|(s, f)| s[0] += sign * f * shift);
        }
    }

    /// Computes the speed of a condition (per second), its typical size, and its derivative for each seed.
    pub(super) fn crossing(
        &mut self,
        system: &System,
        condition: usize,
        time: f64,
        rates: &[f64],
        columns: Option<&Columns>,
    ) -> (f64, f64, Vec<f64>) {
        let gradient = &system.condition_gradients[condition];
        self.block.evaluate(system, &gradient.section, &self.step_inputs, &[time]);
        let (speed, typical_speed) = condition_speed(gradient, &self.block, rates);
        let mut slope = [0.0];
        let mut slopes = Vec::new();
        for seed in 0..columns.map_or(0, |c| c.seeds.len()) {
            if let Some(columns) = columns {
                self.block.directional_derivatives(gradient, columns, seed, 0, &mut slope);
            }
            slopes.push(slope[0]);
        }
        (speed, typical_speed, slopes)
    }

    /// Starts the rest of an event if its condition changes slowly enough and the rest would not end at once.
    pub(super) fn try_to_rest(
        &mut self,
        system: &System,
        event: usize,
        time: f64,
        side: f64,
        reset: &mut [f64],
    ) -> bool {
        let Some(rest) = &system.model.events[event].rest else { return false };
        let speed = self.speed(system, event, time);
        let exhausted = self.mode.fired >= MAX_EVENTS_PER_WINDOW;
        if speed.abs() >= rest.below && !exhausted {
            return false;
        }
        let set = system.model.events[event].set.iter().map(|(state, _)| *state);
        for state in set.filter(|s| !rest.hold.contains(s)) {
            self.block.x[state][0] = 0.0;
        }
        let conditions = self.conditions(system, time);
        let ends_at_once = system.rest_ends[event].is_some_and(|until| conditions[until] > 0.0);
        if ends_at_once {
            (0..reset.len()).for_each(|i| self.block.x[i][0] = reset[i]);
            return false;
        }
        self.mode.resting[event] = Some(side);
        self.mode.update_fixed(system);
        true
    }

    /// Updates, after an event, on which side of 0 each condition is.
    ///
    /// The side of the event's own condition follows from its direction of motion, the others from their values.
    pub(super) fn update_sides_after_event(&mut self, system: &System, event: usize, time: f64) {
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
