//! Simulates a block of windows from their first samples to their last.

use super::block::{Block, Columns, StepInputs};
use super::diagnose::diverged;
use super::lane::Lane;
use super::rows::{Row, Rows, filled};
use super::schedule::{SchedulePiece, pieces};
use super::stability::{FastestMode, fastest_modes, unstable};
use super::{Method, Options, Seed, Simulated, SimulationError, Window, euler};
use crate::system::System;

/// A block of windows during its simulation, one window per lane.
pub(super) struct Run<'r, const L: usize> {
    system: &'r System,
    windows: Vec<&'r Window<'r>>,
    /// Number of requested windows; lanes beyond them repeat the last window.
    requested: usize,
    columns: &'r Columns,
    options: &'r Options,
    /// The fastest mode of each window, which limits the length of explicit steps.
    fastest: [FastestMode; L],
    block: Block<L>,
    step_inputs: StepInputs<L>,
    /// The windows as single lanes, if events or bounds may affect one without the others.
    ///
    /// Empty if all lanes step together.
    lanes: Vec<Lane>,
    pub(super) failures: Vec<Option<SimulationError>>,
    results: Vec<Simulated>,
    /// For each smoothed discontinuity, the sum of the squares of its argument; and the number of samples.
    ///
    /// `None` if these sums are not recorded.
    pub(super) discontinuity_squares: Option<(Vec<f64>, u32)>,
    /// States of the first window at its samples; `None` if they are not recorded.
    pub(super) states: Option<Vec<f64>>,
    /// Scratch space: states and sensitivities at the start of a step.
    before: (Rows<L>, Rows<L>),
    /// Scratch space: states at the end of a step.
    end: Rows<L>,
    /// Scratch space: conditions of the events in the middle of a step and at its end.
    conditions: [Rows<L>; 2],
    /// Scratch space: outputs at a sample.
    measured: Rows<L>,
    /// Scratch space: derivatives of the outputs, `[output][seed]`.
    slopes: Rows<L>,
}

/// A part of a sample interval, for each lane, in which each input is one cubic.
#[repr(C, align(64))]
struct Part<const L: usize> {
    begin: [f64; L],
    end: [f64; L],
    steps: [usize; L],
    /// Length of an integration step, s; 0 for a lane without steps.
    step: [f64; L],
}

impl<const L: usize> Default for Part<L> {
    fn default() -> Self {
        Self { begin: [0.0; L], end: [0.0; L], steps: [0; L], step: [0.0; L] }
    }
}

impl<const L: usize> Part<L> {
    fn set(&mut self, lane: usize, begin: f64, end: f64, steps: usize) {
        (self.begin[lane], self.end[lane], self.steps[lane]) = (begin, end, steps);
        self.step[lane] = if steps > 0 { (end - begin) / steps as f64 } else { 0.0 };
    }
}

impl<'r, const L: usize> Run<'r, L> {
    /// Prepares the simulation of windows; those that do not fit the system get their error at once.
    pub(super) fn new(
        system: &'r System,
        windows: &'r [Window<'r>],
        columns: &'r Columns,
        options: &'r Options,
    ) -> Self {
        let failures: Vec<_> = windows.iter().map(|w| system.validate(w, &columns.seeds)).collect();
        let usable: Vec<&Window<'_>> =
            windows.iter().zip(&failures).filter(|(_, f)| f.is_none()).map(|(w, _)| w).collect();
        let last = usable.last().copied();
        let lane_windows: Vec<&Window<'_>> = windows
            .iter()
            .zip(&failures)
            .map(|(w, f)| if f.is_none() { Some(w) } else { last })
            .chain(std::iter::repeat(last))
            .take(L)
            .flatten()
            .collect();
        let (n, seeds) = (system.states(), columns.seeds.len());
        let outputs = system.model.outputs.len();
        let room = |(w, failure): (&Window<'_>, &Option<SimulationError>)| {
            let samples = if failure.is_none() { w.last - w.first + 1 } else { 0 };
            let (values, slopes) = (samples * outputs, samples * outputs * seeds);
            Simulated {
                values: Vec::with_capacity(values),
                slopes: Vec::with_capacity(slopes),
                ..Simulated::default()
            }
        };
        let results = windows.iter().zip(&failures).map(room).collect();
        let mut run = Run {
            system,
            windows: lane_windows,
            requested: windows.len(),
            columns,
            options,
            fastest: [FastestMode::default(); L],
            block: Block::new(system, seeds),
            step_inputs: StepInputs::new(system.model.inputs.len()),
            lanes: Vec::new(),
            failures,
            results,
            discontinuity_squares: None,
            states: None,
            before: (filled(n, [0.0; L]), filled(n * seeds, [0.0; L])),
            end: filled(n, [0.0; L]),
            conditions: [(); 2].map(|()| filled(system.model.events.len(), [0.0; L])),
            measured: filled(outputs, [0.0; L]),
            slopes: filled(outputs * seeds, [0.0; L]),
        };
        run.begin();
        run
    }

    /// Sets the parameters, the initial states, and the unit sensitivities of the initial states.
    fn begin(&mut self) {
        let (system, n) = (self.system, self.system.states());
        let steps_alone = !system.is_smooth() || !self.options.method.is_explicit();
        for (lane, window) in self.windows.iter().enumerate() {
            self.block.set_parameters(system, lane, window.parameters);
            (0..n).for_each(|i| self.block.x[i][lane] = window.start[i]);
            for (seed, seed_kind) in self.columns.seeds.iter().enumerate() {
                if let Seed::Start(state) = seed_kind {
                    self.block.s[seed * n + state][lane] = 1.0;
                }
            }
        }
        self.block.prepare(system);
        self.limit_steps();
        if steps_alone {
            for index in 0..self.windows.len() {
                let window = self.windows[index];
                let mut lane = Lane::new(system, self.columns.seeds.len(), window.parameters);
                self.extract_lane(index, &mut lane, false);
                self.sample_inputs(index, window.first);
                copy_inputs(&self.step_inputs, index, &mut lane.step_inputs);
                lane.begin(system, window.record.times[window.first]);
                self.insert_lane(index, &lane);
                self.lanes.push(lane);
            }
        }
    }

    /// Determines how many steps each window needs for stability; a window that needs too many fails.
    fn limit_steps(&mut self) {
        if self.system.states() == 0 {
            return;
        }
        for lane in 0..self.windows.len() {
            self.sample_inputs(lane, self.windows[lane].first);
        }
        let windows = &self.windows;
        let options = (self.options.method, self.options.substeps);
        self.fastest = fastest_modes(self.system, &mut self.block, &self.step_inputs, windows, options);
        let errors = unstable(self.system, windows, &self.fastest);
        for (failure, error) in self.failures.iter_mut().zip(errors) {
            *failure = failure.take().or(error);
        }
    }

    /// Simulates all windows to their last samples; returns the sums over discontinuity arguments, if recorded.
    pub(super) fn advance_all(&mut self) -> Option<(Vec<f64>, u32)> {
        let intervals = self.windows.iter().map(|w| w.last - w.first).max().unwrap_or(0);
        if !self.windows.is_empty() {
            self.record_outputs(0);
            for interval in 0..intervals {
                self.advance_interval(interval);
                self.record_outputs(interval + 1);
                if self.failures.iter().all(Option::is_some) {
                    break;
                }
            }
        }
        self.discontinuity_squares.take()
    }

    /// Simulates all windows to their last samples; returns the result of each.
    pub(super) fn run(mut self) -> Vec<Result<Simulated, SimulationError>> {
        self.advance_all();
        let n = self.system.states();
        for (lane, result) in self.results.iter_mut().enumerate() {
            result.end = self.block.x.iter().map(|x| x[lane]).collect();
            let at = |i: usize, seed: usize| self.block.s[seed * n + i][lane];
            let seeds = self.columns.seeds.len();
            result.end_slopes =
                (0..n).flat_map(|i| (0..seeds).map(move |seed| (i, seed))).map(|(i, s)| at(i, s)).collect();
            if let Some(lane) = self.lanes.get_mut(lane) {
                result.events = std::mem::take(&mut lane.events);
            }
        }
        self.results.into_iter().zip(self.failures).map(|(r, f)| f.map_or(Ok(r), Err)).collect()
    }

    /// Whether the window of a lane has sample interval number `interval` and has not failed.
    fn is_live(&self, lane: usize, interval: usize) -> bool {
        let window = self.windows[lane];
        interval < window.last - window.first && self.failures.get(lane).is_none_or(Option::is_none)
    }

    /// Number of integration steps of a lane in a sample interval of this length, s.
    fn substeps(&self, lane: usize, interval_s: f64) -> usize {
        match self.options.method {
            Method::Euler { step_s } => euler::steps(interval_s, step_s),
            _ => self.fastest[lane].substeps(
                interval_s,
                self.options.substeps,
                self.system.max_stable_substeps,
            ),
        }
    }

    /// Advances every lane by a sample interval.
    fn advance_interval(&mut self, interval: usize) {
        // A system without states has nothing to integrate: its outputs are functions of inputs and time.
        if self.system.states() == 0 {
            return;
        }
        let model = &self.system.model;
        let is_aligned = model.inputs.iter().all(|i| i.delay.is_none())
            && self.windows.iter().all(|w| w.record.is_aligned);
        if is_aligned {
            // The inputs are set already: to the pieces that start at the sample that was recorded last.
            let mut part = Part::default();
            for (lane, window) in self.windows.iter().enumerate() {
                let times = &window.record.times;
                let live = self.is_live(lane, interval);
                let from = (window.first + interval).min(window.last);
                let to = if live { from + 1 } else { from };
                let substeps = self.substeps(lane, times[to] - times[from]);
                part.set(lane, times[from], times[to], if live { substeps } else { 0 });
            }
            return self.advance_part(&part);
        }
        let pieces_of_lane = |lane: usize| -> Vec<SchedulePiece> {
            let window = self.windows[lane];
            if !self.is_live(lane, interval) {
                return Vec::new();
            }
            let sample = window.first + interval;
            let times = &window.record.times;
            let substeps = self.substeps(lane, times[sample + 1] - times[sample]);
            pieces(model, window.record, window.parameters, sample, substeps)
        };
        let pieces_by_lane: Vec<Vec<SchedulePiece>> = (0..L).map(pieces_of_lane).collect();
        for index in 0..pieces_by_lane.iter().map(Vec::len).max().unwrap_or(0) {
            let mut part = Part::default();
            let no_piece = SchedulePiece::default();
            for (lane, pieces) in pieces_by_lane.iter().enumerate() {
                let last = pieces.last().map_or(0.0, |p| p.end);
                let piece = pieces.get(index).unwrap_or(&no_piece);
                self.add_delay_jump(lane, piece);
                let (begin, end) = if piece.steps > 0 { (piece.begin, piece.end) } else { (last, last) };
                part.set(lane, begin, end, piece.steps);
                self.step_inputs.begin[lane] = begin;
                for (input, c) in piece.inputs.iter().enumerate() {
                    (0..4).for_each(|power| self.step_inputs.coefficients[input][power][lane] = c[power]);
                }
            }
            self.advance_part(&part);
        }
    }

    /// Advances every lane (window) over a part of its sample interval.
    fn advance_part(&mut self, part: &Part<L>) {
        if let Method::Reference { tolerance } = self.options.method {
            return self.advance_adaptively(part, tolerance);
        }
        for step in 0..part.steps.iter().max().copied().unwrap_or(0) {
            let (mut time, mut h) = (Row(part.end), Row([0.0; L]));
            for lane in (0..L).filter(|lane| step < part.steps[*lane]) {
                h.0[lane] = part.step[lane];
                time.0[lane] = part.begin[lane] + step as f64 * h.0[lane];
            }
            self.step(&time.0, &h.0);
        }
    }

    /// The variables of differentiation; `None` if there are no seeds.
    fn columns(&self) -> Option<&'r Columns> {
        let columns: &'r Columns = self.columns;
        (!columns.seeds.is_empty()).then_some(columns)
    }

    /// Takes a step of all lanes; lanes with a discontinuity in the step repeat it by themselves.
    fn step(&mut self, time: &[f64; L], h: &[f64; L]) {
        if self.lanes.is_empty() {
            return self.step_together(time, h);
        }
        self.before.0.copy_from_slice(&self.block.x);
        self.before.1.copy_from_slice(&self.block.s);
        let repeats = if self.options.method.is_explicit() {
            self.step_together(time, h);
            self.lanes_with_discontinuities(time, h)
        } else {
            [true; L]
        };
        for index in 0..L {
            let failed = self.failures.get(index).is_some_and(Option::is_some);
            if repeats[index] && h[index] > 0.0 && !failed && index < self.requested {
                self.repeat_step(index, time[index], h[index]);
            }
        }
    }

    /// Takes a step of all lanes in one pass, without looking for discontinuities.
    fn step_together(&mut self, time: &[f64; L], h: &[f64; L]) {
        let (system, columns) = (self.system, self.columns());
        match self.options.method {
            Method::Euler { .. } => {
                euler::step(&mut self.block, system, &self.step_inputs, (time, h), columns, &[]);
            }
            _ => self.block.step(system, &self.step_inputs, (time, h), columns, &[]),
        }
    }

    /// Repeats the step of one window by itself, stopping at its discontinuities.
    fn repeat_step(&mut self, index: usize, time: f64, h: f64) {
        let (system, columns, method) = (self.system, self.columns(), self.options.method);
        let mut lane = std::mem::replace(&mut self.lanes[index], Lane::empty());
        self.extract_lane(index, &mut lane, true);
        copy_inputs(&self.step_inputs, index, &mut lane.step_inputs);
        if let Err(failure) = lane.step_through_events(system, method, (time, h), columns) {
            self.failures[index] = Some(failure.into_error(system, &self.windows[index].record.name));
        }
        self.insert_lane(index, &lane);
        self.lanes[index] = lane;
    }

    /// Finds the lanes in which a discontinuity may have occurred during the step that was just taken.
    ///
    /// The conditions of events are checked in the middle and at the end of the step.
    fn lanes_with_discontinuities(&mut self, time: &[f64; L], h: &[f64; L]) -> [bool; L] {
        let (system, n) = (self.system, self.system.states());
        let (events, block) = (system.model.events.len(), &mut self.block);
        let [middle, last] = &mut self.conditions;
        let read = |block: &Block<L>, to: &mut Rows<L>| {
            let results = to.iter_mut().zip(&system.conditions.results);
            results.for_each(|(to, r)| to.copy_from_slice(&block.registers[*r as usize]));
        };
        self.end.copy_from_slice(&block.x);
        let at_end: [f64; L] = std::array::from_fn(|lane| time[lane] + h[lane]);
        block.evaluate(system, &system.conditions, &self.step_inputs, &at_end);
        read(block, last);
        block.evaluate(system, &system.rates, &self.step_inputs, &at_end);
        for i in 0..n {
            let last_rate = &block.registers[system.rates.results[i] as usize];
            for lane in 0..L {
                // The state in the middle, by the cubic through both ends with their rates.
                let bend = 0.125 * h[lane] * (block.first_rate[i][lane] - last_rate[lane]);
                block.x[i][lane] = 0.5 * (self.before.0[i][lane] + self.end[i][lane]) + bend;
            }
        }
        let half: [f64; L] = std::array::from_fn(|lane| time[lane] + 0.5 * h[lane]);
        block.evaluate(system, &system.conditions, &self.step_inputs, &half);
        read(block, middle);
        let is_beyond_bounds = |i: usize, x: f64| {
            let state = &system.model.states[i];
            state.min.is_some_and(|min| x < min) || state.max.is_some_and(|max| x > max)
        };
        let mut has_discontinuity = [false; L];
        for (lane, single) in self.lanes.iter().enumerate() {
            let may_fire = |event: usize| {
                let side = single.mode.sides[event];
                side * middle[event][lane] <= 0.0
                    || side * last[event][lane] <= 0.0
                    || middle[event][lane] * last[event][lane] <= 0.0
            };
            let may_hit_bound =
                |i: usize| is_beyond_bounds(i, self.end[i][lane]) || is_beyond_bounds(i, block.x[i][lane]);
            has_discontinuity[lane] =
                !single.mode.is_free() || (0..events).any(may_fire) || (0..n).any(may_hit_bound);
        }
        block.x.copy_from_slice(&self.end);
        has_discontinuity
    }

    /// Advances every lane over a part of its interval with the adaptive reference integrator.
    fn advance_adaptively(&mut self, part: &Part<L>, tolerance: f64) {
        for index in 0..L {
            let failed = self.failures.get(index).is_some_and(Option::is_some);
            if part.steps[index] == 0 || failed || index >= self.requested {
                continue;
            }
            let mut lane = std::mem::replace(&mut self.lanes[index], Lane::empty());
            self.extract_lane(index, &mut lane, false);
            copy_inputs(&self.step_inputs, index, &mut lane.step_inputs);
            if let Err(failure) =
                lane.advance_adaptively(self.system, (part.begin[index], part.end[index]), tolerance)
            {
                self.failures[index] =
                    Some(failure.into_error(self.system, &self.windows[index].record.name));
            }
            self.insert_lane(index, &lane);
            self.lanes[index] = lane;
        }
    }

    /// Adds to the sensitivities the jump where a delayed zero-order-hold input changes its value.
    ///
    /// The fitted delay moves the time of the jump: `S += (f before - f after)` for the seed of the delay,
    /// with sensitivities `S` and rates `f`.
    fn add_delay_jump(&mut self, index: usize, piece: &SchedulePiece) {
        let (system, n) = (self.system, self.system.states());
        for input in &piece.jumps {
            let delay = system.model.inputs[*input].delay;
            let is_delay = |seed: &Seed| delay.is_some_and(|d| *seed == Seed::Parameter(d));
            let Some(seed) = self.columns.seeds.iter().position(is_delay) else { continue };
            let time = [piece.begin; L];
            let evaluate_rates = |run: &mut Self| -> Vec<f64> {
                run.block.evaluate(system, &system.rates, &run.step_inputs, &time);
                let at = |r: &u32| run.block.registers[*r as usize][index];
                system.rates.results.iter().map(at).collect()
            };
            let signal = &self.windows[index].record.inputs[*input];
            let delay = delay.map_or(0.0, |d| self.windows[index].parameters[d]);
            let knots = signal.knots();
            let knot = knots.partition_point(|k| k + delay < piece.begin);
            let earlier = signal.piece(knot.saturating_sub(1))[0];
            for (other, c) in piece.inputs.iter().enumerate() {
                (0..4).for_each(|power| self.step_inputs.coefficients[other][power][index] = c[power]);
            }
            self.step_inputs.begin[index] = piece.begin;
            let after = evaluate_rates(self);
            self.step_inputs.coefficients[*input][0][index] =
                if knot == 0 { piece.inputs[*input][0] } else { earlier };
            let before = evaluate_rates(self);
            self.step_inputs.coefficients[*input][0][index] = piece.inputs[*input][0];
            for i in 0..n {
                self.block.s[seed * n + i][index] += before[i] - after[i];
            }
        }
    }

    /// Copies a window out of the block: as it was before the step if `before`, else as it is.
    fn extract_lane(&self, index: usize, lane: &mut Lane, before: bool) {
        let (x, s) = if before { (&self.before.0, &self.before.1) } else { (&self.block.x, &self.block.s) };
        lane.block.x.iter_mut().zip(x.iter()).for_each(|(to, from)| to[0] = from[index]);
        lane.block.s.iter_mut().zip(s.iter()).for_each(|(to, from)| to[0] = from[index]);
    }

    /// Copies a window that was advanced by itself back into the block.
    fn insert_lane(&mut self, index: usize, lane: &Lane) {
        self.block.x.iter_mut().zip(lane.block.x.iter()).for_each(|(to, from)| to[index] = from[0]);
        self.block.s.iter_mut().zip(lane.block.s.iter()).for_each(|(to, from)| to[index] = from[0]);
    }

    /// Sets the inputs of a lane to the cubics that begin at a sample.
    fn sample_inputs(&mut self, lane: usize, sample: usize) {
        let window = self.windows[lane];
        let time = window.record.times[sample];
        self.step_inputs.begin[lane] = time;
        for (input, signal) in window.record.inputs.iter().enumerate() {
            let delay = self.system.model.inputs[input].delay.map_or(0.0, |d| window.parameters[d]);
            let c = if window.record.is_aligned && delay == 0.0 {
                signal.piece(sample)
            } else {
                signal.coefficients_around(time - delay, time - delay)
            };
            (0..4).for_each(|power| self.step_inputs.coefficients[input][power][lane] = c[power]);
        }
    }

    /// Records the outputs of sample `index` of each window.
    fn record_outputs(&mut self, index: usize) {
        let system = self.system;
        let mut time = [0.0; L];
        for lane in 0..self.windows.len() {
            let window = self.windows[lane];
            let sample = (window.first + index).min(window.last);
            time[lane] = window.record.times[sample];
            self.sample_inputs(lane, sample);
            let live = self.failures.get(lane).is_some_and(Option::is_none);
            if live && !self.block.x.iter().all(|x| x[lane].is_finite()) {
                let state = self.block.x.iter().position(|x| !x[lane].is_finite()).unwrap_or(0);
                self.failures[lane] = Some(diverged(system, window, index, state, self.options));
            }
        }
        if let Some((squares, count)) = &mut self.discontinuity_squares {
            self.block.evaluate(system, &system.discontinuity_arguments, &self.step_inputs, &time);
            let arguments =
                system.discontinuity_arguments.results.iter().map(|r| self.block.registers[*r as usize][0]);
            squares.iter_mut().zip(arguments).for_each(|(sum, z)| *sum += z * z);
            *count += 1;
        }
        if let Some(states) = &mut self.states {
            states.extend(self.block.x.iter().map(|x| x[0]));
        }
        let block = &mut self.block;
        block.measure(system, &self.step_inputs, &time, self.columns, &mut self.measured, &mut self.slopes);
        for (lane, result) in self.results.iter_mut().enumerate() {
            let window = self.windows[lane];
            if self.failures[lane].is_none() && index <= window.last - window.first {
                result.values.extend(self.measured.iter().map(|v| v[lane]));
                result.slopes.extend(self.slopes.iter().map(|c| c[lane]));
            }
        }
    }
}

/// Copies the inputs of one lane of a block.
fn copy_inputs<const L: usize>(from: &StepInputs<L>, lane: usize, to: &mut StepInputs<1>) {
    to.begin[0] = from.begin[lane];
    for (to, from) in to.coefficients.iter_mut().zip(from.coefficients.iter()) {
        to.iter_mut().zip(from).for_each(|(to, from)| to[0] = from[lane]);
    }
}
