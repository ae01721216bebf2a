//! The explicit Euler step, which repeats the steps of a simulator that an external function calls.
//!
//! With the rates `f = (next(x) - x) / dt` of a function `next` that advances the states by `dt`, a step of that length
//! gives `x + dt f = next(x)`; with `J = df/dx` and `P = df/dp` the sensitivities `S = dx/dp` become `S + dt (J S + P)`.

use super::block::{Block, Columns, StepInputs};
use crate::system::{Column, System};

/// Takes an explicit Euler step of length `h` (s) from `time` for all windows; the rates of states that are `fixed` are 0.
pub(super) fn step<const L: usize>(
    block: &mut Block<L>,
    system: &System,
    step_inputs: &StepInputs<L>,
    (time, h): (&[f64; L], &[f64; L]),
    columns: Option<&Columns>,
    fixed: &[bool],
) {
    let n = system.states();
    let section = if columns.is_some() { &system.rate_gradient.section } else { &system.rates };
    block.evaluate(system, section, step_inputs, time);
    let is_fixed = |state: usize| fixed.get(state) == Some(&true);
    if let Some(columns) = columns {
        let mut change = vec![[0.0; L]; n];
        for (s, active) in block.s.chunks_exact_mut(n.max(1)).zip(&columns.active) {
            change.fill([0.0; L]);
            for entry in system.rate_gradient.entries.iter().filter(|entry| !is_fixed(entry.row)) {
                let (derivative, to) = (&block.registers[entry.register], &mut change[entry.row]);
                match entry.column {
                    Column::State(state) => {
                        (0..L).for_each(|l| to[l] = derivative[l].mul_add(s[state][l], to[l]));
                    }
                    Column::Active(k) if *active == Some(k) => {
                        (0..L).for_each(|l| to[l] += derivative[l]);
                    }
                    _ => {}
                }
            }
            for (s, change) in s.iter_mut().zip(&change) {
                (0..L).for_each(|l| s[l] = h[l].mul_add(change[l], s[l]));
            }
        }
    }
    for state in 0..n {
        let rate = if is_fixed(state) { [0.0; L] } else { block.registers[section.results[state] as usize] };
        block.first_rate[state] = rate;
        (0..L).for_each(|l| block.x[state][l] = h[l].mul_add(rate[l], block.x[state][l]));
    }
}

/// Maximum number of Euler steps in a sample interval; longer steps are taken in a longer pause.
const MAX_STEPS_PER_INTERVAL: f64 = 100_000.0;

/// Number of Euler steps of about `step_s` in an interval (s), at least one.
pub(super) fn steps(interval_s: f64, step_s: f64) -> usize {
    (interval_s / step_s).round().clamp(1.0, MAX_STEPS_PER_INTERVAL) as usize
}
