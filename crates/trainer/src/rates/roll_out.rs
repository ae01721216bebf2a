//! Roll-outs of the physics with corrected rates, several at once.

use super::features::{width, write};
use crate::Samples;
use crate::engine::EquationMotion;
use crate::scales::Scales;

/// Initial states of a batch of roll-outs, their common actions, and their length.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RollOuts<'a> {
    /// Initial states `[lane, S]`, one lane per roll-out, S state columns.
    pub starts: &'a [f64],
    /// Actions `[time, A]` that all roll-outs share, A action columns.
    pub actions: &'a [f64],
    /// Number of samples of a roll-out, including the initial state.
    pub time: usize,
}

/// Simulates all roll-outs (lanes) with corrected rates and returns their states.
/// For the features `[U, lane]` of an interval, `correct` writes the corrections of the rates `[D, lane]`,
/// per second.
pub(crate) fn roll_out(
    motion: &EquationMotion,
    scales: &Scales,
    motions: RollOuts<'_>,
    correct: &mut dyn FnMut(&[f32], &mut [f64]),
) -> Samples {
    let RollOuts { starts, actions, time } = motions;
    let (s, d, u_width) = (motion.periods().len(), motion.corrected_count(), width(motion));
    let (lanes, a) = (starts.len() / s, actions.len() / time);
    let mut values = vec![0.0_f32; time * s * lanes];
    let (mut now, mut next) = (starts.to_vec(), vec![0.0; lanes * s]);
    let (mut row, mut u) = (vec![0.0; u_width], vec![0.0; u_width * lanes]);
    let (mut rates, mut lane_rates) = (vec![0.0; d * lanes], vec![0.0; d]);
    for (t, values) in values.chunks_exact_mut(s * lanes).enumerate() {
        for (lane, state) in now.chunks_exact(s).enumerate() {
            state.iter().enumerate().for_each(|(j, x)| values[j * lanes + lane] = *x as f32);
        }
        if t + 1 == time {
            break;
        }
        let (from, to) = (&actions[t * a..(t + 1) * a], &actions[(t + 1) * a..(t + 2) * a]);
        motion.advance(&now, &from.repeat(lanes), &to.repeat(lanes), &mut next);
        for lane in 0..lanes {
            let (from_state, to_state) = (&now[lane * s..][..s], &next[lane * s..][..s]);
            write(motion, scales, from_state, to_state, [from, to], &mut row);
            u[lane..].iter_mut().step_by(lanes).zip(&row).for_each(|(slot, v)| *slot = *v);
        }
        correct(&u, &mut rates);
        for (lane, now) in now.chunks_exact_mut(s).enumerate() {
            lane_rates.iter_mut().enumerate().for_each(|(k, rate)| *rate = rates[k * lanes + lane]);
            motion.correct(&next[lane * s..][..s], to, &lane_rates, now);
        }
    }
    Samples { count: lanes, values }
}

/// Returns one initial state per sample, from one state `[S]` for all samples or one for each.
pub(crate) fn repeat_starts(start: &[f64], states: usize, samples: usize) -> Vec<f64> {
    if start.len() == states { start.repeat(samples) } else { start.to_vec() }
}
