//! The number of explicit steps that keeps a window stable.
//!
//! A step `h` of the classical Runge-Kutta method of order 4 multiplies a mode `x' = -r x` by
//!
//! 1. `R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24`, `z = -r h`
//!
//! instead of `exp(z)`. Beyond the stability limit (`z` = -2.79) `R` grows without bound, and near it `R` has
//! the value of a slow mode: `R(-2.73)` is 0.92, as for a mode with `r h` = 0.08. A fit could therefore match
//! data with a time constant that is 30 times too short. The steps of a window are divided until (2) holds,
//! with the spectral radius `r` of the derivatives of the rates at the window's start.
//!
//! 2. `r h <= 2.5`

use super::block::{Block, StepInputs};
use super::{Method, Point, SimulationError, Window};
use crate::limits::MAX_SUBSTEPS;
use crate::system::{Column, System};

/// Maximum product of the fastest mode's rate (1/s) and the step length (s) for explicit steps.
///
/// The stability limit of classical Runge-Kutta on the negative real axis is 2.79; close to it the step is
/// stable but not accurate.
pub(super) const STABILITY_LIMIT: f64 = 2.5;
/// Maximum phase of an added periodic effect in a step, rad. Simpson's rule, to which the steps reduce for a force of time,
/// integrates a sine to 1/2880 of the fourth power of the phase: 2e-3 at 1.5.
const MAX_PHASE: f64 = 1.5;
/// Maximum number of steps in a sample interval for the cycles of an added effect. At speeds where more than two cycles pass in an
/// interval it has no effect in the mean, and matters only while the motion is slower.
const MAX_CYCLE_STEPS: usize = 8;
/// Number of times the matrix is squared for the norm that bounds its spectral radius.
const SQUARINGS: usize = 6;

/// The fastest mode of a window's linearised rates, as far as it limits the steps.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FastestMode {
    /// Spectral radius of the Jacobian of the rates, 1/s; 0 if it does not limit the steps.
    rate: f64,
    /// Index of the state that the mode moves most.
    state: usize,
    /// Angular rate of the fastest cycle of an added periodic effect, rad/s.
    cycle_rate: f64,
}

impl FastestMode {
    /// Number of integration steps that an interval of this length (s) needs, at least `substeps` and at most `max_substeps`.
    pub(super) fn substeps(&self, interval_s: f64, substeps: usize, max_substeps: usize) -> usize {
        // The limit holds only for lanes that repeat a window which was refused.
        let stable = (self.rate * interval_s / STABILITY_LIMIT).ceil() as usize;
        let cycles = ((self.cycle_rate * interval_s / MAX_PHASE).ceil() as usize).min(MAX_CYCLE_STEPS);
        substeps.max(stable.max(cycles).min(max_substeps))
    }

    /// Error if an interval of the window needs more than `max_substeps` steps; `None` if none does.
    fn check(&self, system: &System, window: &Window<'_>, max_substeps: usize) -> Option<SimulationError> {
        let state = || system.model.states[self.state].name.clone();
        let is_too_long = |interval: f64| self.rate * interval > STABILITY_LIMIT * max_substeps as f64;
        let times = &window.record.times[window.first..=window.last];
        let mut intervals: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let longest = (0..intervals.len()).max_by(|a, b| intervals[*a].total_cmp(&intervals[*b]))?;
        if !is_too_long(intervals[longest]) {
            return None;
        }
        let (from, to) = (times[longest], times[longest + 1]);
        let middle = intervals.len() / 2;
        let typical = *intervals.select_nth_unstable_by(middle, f64::total_cmp).1;
        // If most intervals are short enough, the cause is the pause and not the system.
        Some(if is_too_long(typical) {
            SimulationError::Stiff { state: state(), rate: self.rate, ratio: self.rate * (to - from) }
        } else {
            let record = window.record.name.clone();
            SimulationError::Pause { record, from, to, state: state(), rate: self.rate }
        })
    }
}

/// Finds the fastest mode of each lane at the start of its window, where `block` and `step_inputs` are.
///
/// Explicit steps are limited by this mode; steps of other methods are not.
pub(super) fn fastest_modes<const L: usize>(
    system: &System,
    block: &mut Block<L>,
    step_inputs: &StepInputs<L>,
    windows: &[&Window<'_>],
    (method, substeps): (Method, usize),
) -> [FastestMode; L] {
    let mut modes = [FastestMode::default(); L];
    if method != Method::RungeKutta {
        return modes;
    }
    let n = system.states();
    let gradient = &system.rate_gradient;
    let times: [f64; L] = std::array::from_fn(|l| windows.get(l).map_or(0.0, |w| w.record.times[w.first]));
    block.evaluate(system, &gradient.section, step_inputs, &times);
    let mut jacobian = vec![0.0; n * n];
    for (lane, window) in windows.iter().enumerate() {
        for entry in &gradient.entries {
            if let Column::State(state) = entry.column {
                jacobian[entry.row * n + state] = block.registers[entry.register][lane];
            }
        }
        let allowed = STABILITY_LIMIT * substeps as f64 / longest_interval_s(window);
        modes[lane] = limiting_mode(&jacobian, n, allowed);
        modes[lane].cycle_rate = system.cycle_rate(window.parameters);
    }
    modes
}

/// Duration of the longest sample interval of a window, s.
pub(super) fn longest_interval_s(window: &Window<'_>) -> f64 {
    let times = &window.record.times[window.first..=window.last];
    times.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
}

/// Lists the errors of windows whose fastest mode needs too many explicit steps.
pub(super) fn unstable(
    system: &System,
    windows: &[&Window<'_>],
    modes: &[FastestMode],
) -> Vec<Option<SimulationError>> {
    windows
        .iter()
        .zip(modes)
        .map(|(window, mode)| mode.check(system, window, system.max_stable_substeps))
        .collect()
}

impl System {
    /// Whether the system is stiff: a window needs more explicit steps than [`System::choose_steps`] tries.
    ///
    /// The steps per sample interval follow from the fastest mode at the start of the window.
    pub(super) fn is_stiff(&self, windows: &[Window<'_>]) -> bool {
        windows.iter().any(|window| {
            let by_state = self.jacobian_at_start(window);
            let mode = limiting_mode(&by_state, self.states(), STABILITY_LIMIT / longest_interval_s(window));
            matches!(mode.check(self, window, MAX_SUBSTEPS), Some(SimulationError::Stiff { .. }))
        })
    }

    /// Derivatives of the rates with respect to the states at the start of a window, `[rate][state]`.
    pub(super) fn jacobian_at_start(&self, window: &Window<'_>) -> Vec<f64> {
        let time = window.record.times[window.first];
        let inputs: Vec<f64> = window.record.inputs.iter().map(|signal| signal.at(time)).collect();
        let (state, parameters) = (window.start, window.parameters);
        self.linearise(&Point { state, inputs: &inputs, parameters, time }).by_state
    }
}

/// Finds the fastest mode of a matrix; none (rate 0) if its rate is at most `allowed`.
///
/// Every norm of a power bounds the spectral radius: `r <= |A^k|^(1/k)`. Most matrices need no more than the
/// first norm.
fn limiting_mode(jacobian: &[f64], n: usize, allowed: f64) -> FastestMode {
    let norm = row_sum_norm(jacobian, n);
    if norm <= allowed || !norm.is_finite() {
        return FastestMode::default();
    }
    let (rate, state) = fastest_mode(jacobian, n);
    FastestMode { rate: if rate > allowed { rate } else { 0.0 }, state, ..FastestMode::default() }
}

/// Maximum over the rows of a matrix of the sum of the absolute values.
fn row_sum_norm(matrix: &[f64], n: usize) -> f64 {
    matrix.chunks_exact(n.max(1)).map(|row| row.iter().map(|x| x.abs()).sum()).fold(0.0, f64::max)
}

/// Computes the spectral radius of a matrix, and the index of the row that its dominant mode moves most.
///
/// By Gelfand's formula, it is the norm of the 64th power to the power 1/64: within some percent, also for
/// complex eigenvalues.
pub(crate) fn fastest_mode(jacobian: &[f64], n: usize) -> (f64, usize) {
    let mut power = jacobian.to_vec();
    let mut exponent = 1.0;
    let mut logarithm = 0.0_f64;
    for _ in 0..=SQUARINGS {
        let norm = power.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
        if norm == 0.0 || !norm.is_finite() {
            return (norm, 0);
        }
        logarithm += norm.ln() / exponent;
        power.iter_mut().for_each(|x| *x /= norm);
        let mut square = vec![0.0; n * n];
        for (i, row) in square.chunks_exact_mut(n.max(1)).enumerate() {
            for (j, to) in row.iter_mut().enumerate() {
                *to = (0..n).map(|k| power[i * n + k] * power[k * n + j]).sum();
            }
        }
        power = square;
        exponent *= 2.0;
    }
    let weight = |row: usize| power[row * n..][..n].iter().map(|x| x.abs()).sum::<f64>();
    let row = (0..n).max_by(|a, b| weight(*a).total_cmp(&weight(*b))).unwrap_or(0);
    (logarithm.exp(), row)
}
