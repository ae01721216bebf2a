//! State and sensitivities across an event, the end of a rest, or a wall: with `g` the condition, `R` the reset and `f`
//! the rates before and after, the time of the event moves by `tau' = -(g_x S + g_p) / (g_x f- + g_t)` and
//! `S+ = R_x (S + f- tau') + R_p + R_t tau' - f+ tau'`.

use super::EventSeen;
use super::block::Columns;
use super::lane::{Lane, Trouble, rate_of};
use super::walk::Watched;
use crate::limits::EVENTS_PER_WINDOW;
use crate::system::{Column, System};

/// Below this share of its usual speed a condition passes 0 so slowly that the time of the event has no derivative to
/// rely on.
const GRAZING: f64 = 1e-6;

impl Lane {
    /// Carries state and sensitivities across what happens at `time`.
    pub(super) fn happen(
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
    pub(super) fn shift(&mut self, rates: &[f64], shifts: &[f64], sign: f64) {
        for (column, shift) in self.block.s.chunks_exact_mut(rates.len()).zip(shifts) {
            column.iter_mut().zip(rates).for_each(|(s, f)| s[0] += sign * f * shift);
        }
    }

    /// Speed of a condition, the usual size of that speed, and the condition's derivative for each seed.
    pub(super) fn passage(
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
    pub(super) fn comes_to_rest(
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
    pub(super) fn learn_sides(&mut self, system: &System, event: usize, time: f64) {
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
