//! Outputs of systems without states: functions of inputs and time, which may pass a low-pass.
//!
//! Nothing is integrated, so the samples of a window are computed in parts, side by side. An output `y` with a low-pass has, at
//! a sample at the time `t`, the value
//!
//! ```text
//! sum over k of w_k y(t_k) / sum over k of w_k,    w_k = g(t - t_k) d_k        (1)
//! ```
//!
//! over the samples `t_k` of the inputs within the reach of the response `g`, where `d_k` is the part of the time that lies
//! nearest to `t_k`. Its derivatives have the same weights.

use super::{Options, Seed, Signal, Simulated, SimulationError, Window};
use crate::model::Model;
use crate::system::System;
use augsim_robot::signals::LowPassResponse;
use rayon::prelude::*;
use std::ops::Range;

/// Number of samples of a window that are computed together, which bounds the memory for their derivatives.
const BLOCK_SAMPLES: usize = 64;
/// Smallest number of times that one lane computes; the cost of starting a lane is that of a few of them.
const LANE_TIMES: usize = 32;
/// Number of lanes among which the times of a block are shared.
const LANES: usize = 32;

impl Model {
    /// Longest time around a sample from which its outputs are computed, s; 0 if no output has a low-pass.
    pub(crate) fn low_pass_reach_s(&self) -> f64 {
        let reach = |cutoff_hz| LowPassResponse::new(cutoff_hz).reach_s();
        self.outputs.iter().filter_map(|o| o.low_pass_hz).map(reach).fold(0.0, f64::max)
    }
}

impl System {
    /// Computes the outputs at the samples of windows, with derivatives with respect to `seeds`.
    ///
    /// # Errors
    /// Each window has its own result, with its own [`SimulationError`].
    pub(super) fn outputs_without_states(
        &self,
        windows: &[Window<'_>],
        seeds: &[Seed],
        options: &Options,
    ) -> Vec<Result<Simulated, SimulationError>> {
        let mut results: Vec<Result<Simulated, SimulationError>> =
            windows.iter().map(|w| self.validate(w, seeds).map_or(Ok(Simulated::default()), Err)).collect();
        let mut blocks: Vec<(usize, Range<usize>)> = Vec::new();
        for (index, window) in windows.iter().enumerate().filter(|(index, _)| results[*index].is_ok()) {
            let starts = (window.first..=window.last).step_by(BLOCK_SAMPLES);
            blocks.extend(starts.map(|a| (index, a..(a + BLOCK_SAMPLES).min(window.last + 1))));
        }
        let of_block = |(index, samples): &(usize, Range<usize>)| {
            self.block_outputs(&windows[*index], samples.clone(), seeds, options)
        };
        let computed: Vec<_> = blocks.par_iter().map(of_block).collect();
        for ((index, _), block) in blocks.iter().zip(computed) {
            match (&mut results[*index], block) {
                (Ok(result), Ok(block)) => {
                    result.values.extend(block.values);
                    result.slopes.extend(block.slopes);
                }
                (result @ Ok(_), Err(error)) => *result = Err(error),
                (Err(_), _) => {}
            }
        }
        results
    }

    /// Outputs at consecutive samples of a window.
    fn block_outputs(
        &self,
        window: &Window<'_>,
        samples: Range<usize>,
        seeds: &[Seed],
        options: &Options,
    ) -> Result<Simulated, SimulationError> {
        let record = window.record;
        let times = &record.times[samples];
        let reach_s = self.model.low_pass_reach_s();
        if reach_s == 0.0 {
            return self.computed_at(window, times.to_vec(), seeds, options);
        }
        let (begin, end) = (times[0] - reach_s, times[times.len() - 1] + reach_s);
        let knots = knots_between(&record.inputs, begin, end);
        let all = merged(&knots, times);
        let computed = self.computed_at(window, all.clone(), seeds, options)?;
        Ok(self.low_passed(times, &all, &knots, &computed, seeds.len()))
    }

    /// Passes outputs that were computed at the times `all` through their low-passes (1), at the samples `times`.
    fn low_passed(
        &self,
        times: &[f64],
        all: &[f64],
        knots: &[f64],
        computed: &Simulated,
        seeds: usize,
    ) -> Simulated {
        let outputs = self.model.outputs.len();
        let mut result = Simulated {
            values: vec![0.0; times.len() * outputs],
            slopes: vec![0.0; times.len() * outputs * seeds],
            ..Simulated::default()
        };
        // Index among all times, and weight without the response, of each knot.
        let knots: Vec<(usize, f64)> = knots
            .iter()
            .zip(interval_shares(knots))
            .map(|(knot, share)| (all.partition_point(|t| t < knot), share))
            .collect();
        for (sample, time) in times.iter().enumerate() {
            let mut first = 0;
            // Neighbouring outputs with the same low-pass have the same weights and lie side by side.
            for group in self.model.outputs.chunk_by(|a, b| a.low_pass_hz == b.low_pass_hz) {
                let weights = group[0].low_pass_hz.map_or_else(Vec::new, |c| weights(*time, c, &knots, all));
                let itself = [(all.partition_point(|t| t < time), 1.0)];
                let places = first..first + group.len();
                for (k, weight) in if weights.is_empty() { &itself[..] } else { &weights[..] } {
                    let part = |row: usize, width: usize| {
                        (row * outputs + places.start) * width..(row * outputs + places.end) * width
                    };
                    add_scaled(&mut result.values[part(sample, 1)], &computed.values[part(*k, 1)], *weight);
                    let (to, from) = (part(sample, seeds), part(*k, seeds));
                    add_scaled(&mut result.slopes[to], &computed.slopes[from], *weight);
                }
                first = places.end;
            }
        }
        result
    }

    /// Outputs at times, with the parameters of a window.
    fn computed_at(
        &self,
        window: &Window<'_>,
        times: Vec<f64>,
        seeds: &[Seed],
        options: &Options,
    ) -> Result<Simulated, SimulationError> {
        let record = window.record.at_times(times)?;
        let count = record.times.len();
        let share = count.div_ceil(LANES).max(LANE_TIMES);
        let lane = |first: usize| Window {
            record: &record,
            first,
            last: (first + share).min(count) - 1,
            start: window.start,
            parameters: window.parameters,
        };
        let lanes: Vec<Window<'_>> = (0..count).step_by(share).map(lane).collect();
        let mut whole = Simulated::default();
        for part in self.run_windows(&lanes, seeds, options) {
            let part = part?;
            whole.values.extend(part.values);
            whole.slopes.extend(part.slopes);
        }
        Ok(whole)
    }
}

/// Adds a multiple of one list of numbers to another.
fn add_scaled(to: &mut [f64], from: &[f64], factor: f64) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from);
}

/// Samples of any input between two times, s, and one before and after them, in increasing order.
fn knots_between(inputs: &[Signal], begin: f64, end: f64) -> Vec<f64> {
    let mut knots: Vec<f64> = Vec::new();
    for input in inputs {
        let of_input = input.knots();
        let from = of_input.partition_point(|t| *t < begin).saturating_sub(1);
        let to = (of_input.partition_point(|t| *t <= end) + 1).min(of_input.len());
        // Most inputs are sampled together.
        if knots != of_input[from..to] {
            knots = merged(&knots, &of_input[from..to]);
        }
    }
    knots
}

/// Merges two lists of increasing times; a time in both appears once.
fn merged(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut all = Vec::with_capacity(a.len() + b.len());
    let (mut a, mut b) = (a.iter().copied().peekable(), b.iter().copied().peekable());
    loop {
        let next = match (a.peek(), b.peek()) {
            (Some(x), Some(y)) => x.min(*y),
            (Some(time), None) | (None, Some(time)) => *time,
            (None, None) => return all,
        };
        a.next_if_eq(&next);
        b.next_if_eq(&next);
        all.push(next);
    }
}

/// Part of the time that is nearest to each of increasing times, s; 1 for a single time.
fn interval_shares(times: &[f64]) -> Vec<f64> {
    let gap = |k: usize| times.get(k + 1).map(|next| next - times[k]);
    let share = |k: usize| {
        let after = gap(k);
        let before = k.checked_sub(1).and_then(gap);
        0.5 * (before.or(after).unwrap_or(1.0) + after.or(before).unwrap_or(1.0))
    };
    (0..times.len()).map(share).collect()
}

/// Weights (1) of the knots within reach of a time, s, each with its index among all times; empty without knots.
fn weights(time: f64, cutoff_hz: f64, knots: &[(usize, f64)], all: &[f64]) -> Vec<(usize, f64)> {
    let response = LowPassResponse::new(cutoff_hz);
    let reach_s = response.reach_s() * (1.0 + 1e-9);
    let from = knots.partition_point(|(k, _)| all[*k] < time - reach_s);
    let to = knots.partition_point(|(k, _)| all[*k] <= time + reach_s);
    let weight = |(k, share): &(usize, f64)| (*k, share * response.at(time - all[*k]));
    let mut weights: Vec<(usize, f64)> = knots[from..to].iter().map(weight).collect();
    let sum: f64 = weights.iter().map(|(_, w)| w).sum();
    // A time before or after all samples of the inputs is in the reach of too few of them.
    if sum <= 0.0 {
        return Vec::new();
    }
    weights.iter_mut().for_each(|(_, w)| *w /= sum);
    weights
}
