//! States and sensitivities of `L` windows, and the Runge-Kutta step that advances both.
//!
//! With rates `f(x, u, p, t)` the sensitivities `S = dx/dp` (one column per seed) follow
//!
//! 1. `x' = f(x, u, p, t)`
//! 2. `S' = J S + P` with `J = df/dx` and `P = df/dp`.
//!
//! Both are advanced by the same classical Runge-Kutta step, so that `S` is the exact derivative of the
//! discrete solution.

use super::Seed;
use super::rows::{CacheAligned, Row, Rows, filled};
use super::sensitivity::{STAGES, Slots, advance_dense_sensitivities};
use crate::compile::Section;
use crate::system::{Column, Entry, Gradient, System};
use pulp::{Simd, WithSimd};

/// Inputs during a step, one per lane (window): cubics in the time since the start of a schedule piece.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct StepInputs<const L: usize> {
    /// Time at the start of the piece in each lane, s.
    pub(crate) begin: [f64; L],
    /// Coefficients of the cubics, `[input][power]`, for each lane.
    pub(crate) coefficients: CacheAligned<[[f64; L]; 4]>,
}

/// `L` windows that are simulated together: registers, states, sensitivities, and reused scratch space.
#[derive(Debug, Clone)]
pub(crate) struct Block<const L: usize> {
    pub(crate) registers: Rows<L>,
    /// State of each window, `[state]`.
    pub(crate) x: Rows<L>,
    /// Sensitivities `S = dx/dp` of the states, `[seed][state]`.
    pub(crate) s: Rows<L>,
    /// Rates of the states at the start of the last step, `[state]`.
    pub(crate) first_rate: Rows<L>,
    stage: Rows<L>,
    sum: Rows<L>,
    /// Derivatives of the rates at the four Runge-Kutta stages, `[stage][slot]`.
    gradients: Rows<L>,
    column: Rows<L>,
}

/// Variables of differentiation (seeds), and where the derivatives of the rates that each needs are stored.
#[derive(Debug, Clone, Default)]
pub(crate) struct Columns {
    pub(crate) seeds: Vec<Seed>,
    /// For each seed, the index of its active parameter; `None` for an initial state.
    pub(crate) active: Vec<Option<usize>>,
    /// For each active parameter, its seed; `None` if it has none.
    seed_of_active: Vec<Option<usize>>,
    /// Slot in which each entry of the gradient of the rates is stored.
    slots: Vec<usize>,
    /// For each rate, its derivatives with respect to the states that are not always 0.
    rows: Vec<Vec<RowEntry>>,
    /// Slot of the derivative of each rate with respect to the seed's own parameter, `[seed][rate]`.
    direct_slots: Vec<Vec<usize>>,
}

/// The derivative of a rate with respect to a state: where it is stored, and of which state.
#[derive(Debug, Clone, Copy)]
struct RowEntry {
    slot: usize,
    state: usize,
    is_one: bool,
}

/// Runs a section of instructions at the present state, in the form that [`pulp`] dispatches to an instruction set.
///
/// A closure would remain a separate function, compiled for the lowest instruction set.
struct Evaluation<'e, const L: usize> {
    system: &'e System,
    section: &'e Section,
    registers: &'e mut [[f64; L]],
    x: &'e [[f64; L]],
    /// Inputs and times to set before the run; `None` if the section depends on parameters alone.
    at: Option<(&'e StepInputs<L>, &'e [f64; L])>,
}

impl<const L: usize> WithSimd for Evaluation<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        if let Some((step_inputs, time)) = self.at {
            self.registers[..self.x.len()].copy_from_slice(self.x);
            step_inputs.set(self.system, self.registers, time);
        }
        self.system.machine.pass(simd, self.section, self.registers);
    }
}

/// Computes outputs and their derivatives at the present state, as [`pulp`] dispatches it to an instruction set.
struct Measurement<'m, const L: usize> {
    block: &'m mut Block<L>,
    system: &'m System,
    step_inputs: &'m StepInputs<L>,
    time: &'m [f64; L],
    columns: &'m Columns,
    values: &'m mut [[f64; L]],
    slopes: &'m mut [[f64; L]],
}

impl<const L: usize> WithSimd for Measurement<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { block, system, step_inputs, time, columns, values, slopes } = self;
        let (gradient, n, seeds) = (&system.output_gradient, block.x.len(), columns.seeds.len());
        let section = if seeds == 0 { &system.outputs } else { &gradient.section };
        block.registers[..n].copy_from_slice(&block.x);
        step_inputs.set(system, &mut block.registers, time);
        system.machine.pass(simd, section, &mut block.registers);
        for (to, result) in values.iter_mut().zip(&section.results) {
            *to = block.registers[*result as usize];
        }
        slopes.fill([0.0; L]);
        for entry in &gradient.entries {
            let g = &block.registers[entry.register];
            match entry.column {
                Column::State(state) => {
                    for seed in 0..seeds {
                        let s = &block.s[seed * n + state];
                        let to = &mut slopes[entry.row * seeds + seed];
                        for lane in 0..L {
                            to[lane] = g[lane].mul_add(s[lane], to[lane]);
                        }
                    }
                }
                Column::Active(k) => {
                    let Some(seed) = columns.seed_of_active[k] else { continue };
                    let to = &mut slopes[entry.row * seeds + seed];
                    for lane in 0..L {
                        to[lane] += g[lane];
                    }
                }
                Column::Time => {}
            }
        }
    }
}

/// Takes a Runge-Kutta step, in the form that [`pulp`] dispatches to an instruction set.
struct Step<'s, const L: usize> {
    block: &'s mut Block<L>,
    system: &'s System,
    step_inputs: &'s StepInputs<L>,
    time: &'s [f64; L],
    h: &'s [f64; L],
    columns: Option<&'s Columns>,
    /// For each state, whether its rate is 0 because of a bound or a rest.
    fixed: &'s [bool],
}

impl<const L: usize> WithSimd for Step<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.block.advance_states(
            simd,
            self.system,
            self.step_inputs,
            (self.time, self.h),
            self.columns,
            self.fixed,
        );
        if let Some(columns) = self.columns {
            let Block { x, s, gradients, .. } = &mut *self.block;
            let is_free = !self.fixed.contains(&true);
            if !(is_free
                && advance_dense_sensitivities(simd, &columns.direct_slots, self.h, gradients, s, x.len()))
            {
                self.block.advance_sensitivities(self.h, columns, self.fixed);
            }
        }
    }
}

impl Columns {
    pub(crate) fn new(system: &System, seeds: &[Seed]) -> Columns {
        let active = |seed: &Seed| match seed {
            Seed::Parameter(p) => system.active.iter().position(|a| a == p),
            Seed::Start(_) => None,
        };
        let (n, entries) = (system.states(), &system.rate_gradient.entries);
        let layout = Slots::new(n, entries.len());
        let slot = |(index, entry): (usize, &Entry)| match entry.column {
            Column::State(state) if layout.dense > 0 => entry.row * n + state,
            _ => layout.dense + index,
        };
        let slots: Vec<usize> = entries.iter().enumerate().map(slot).collect();
        let active: Vec<Option<usize>> = seeds.iter().map(active).collect();
        let mut rows = vec![Vec::new(); n];
        let mut direct_slots = vec![vec![layout.zero(); n]; seeds.len()];
        for (entry, slot) in entries.iter().zip(&slots) {
            match entry.column {
                Column::State(state) => {
                    rows[entry.row].push(RowEntry { slot: *slot, state, is_one: entry.is_one });
                }
                Column::Active(k) => {
                    let matching =
                        direct_slots.iter_mut().zip(&active).filter(|(_, active)| **active == Some(k));
                    matching.for_each(|(direct_slots, _)| direct_slots[entry.row] = *slot);
                }
                Column::Time => {}
            }
        }
        let seed_of_active =
            (0..system.active.len()).map(|k| active.iter().position(|a| *a == Some(k))).collect();
        Columns { seeds: seeds.to_vec(), active, seed_of_active, slots, rows, direct_slots }
    }
}

impl<const L: usize> StepInputs<L> {
    pub(crate) fn new(inputs: usize) -> Self {
        Self { coefficients: filled(inputs, [[0.0; L]; 4]), begin: [0.0; L] }
    }

    /// Sets the registers of time and inputs to their values at `time`, s.
    #[inline(always)]
    pub(crate) fn set(&self, system: &System, registers: &mut [[f64; L]], time: &[f64; L]) {
        let layout = &system.layout;
        registers[layout.time()] = *time;
        for (input, c) in self.coefficients.iter().enumerate() {
            let (value, slope) = (layout.input(input), layout.input_slope(input));
            for lane in 0..L {
                let s = time[lane] - self.begin[lane];
                registers[value][lane] =
                    c[3][lane].mul_add(s, c[2][lane]).mul_add(s, c[1][lane]).mul_add(s, c[0][lane]);
            }
            if !layout.needs_input_slopes {
                continue;
            }
            for lane in 0..L {
                let s = time[lane] - self.begin[lane];
                registers[slope][lane] =
                    (3.0 * c[3][lane]).mul_add(s, 2.0 * c[2][lane]).mul_add(s, c[1][lane]);
            }
        }
    }
}

impl<const L: usize> Block<L> {
    /// Creates a block without windows, as a placeholder for one that was moved out.
    pub(crate) fn empty() -> Self {
        let empty_rows = || filled(0, [0.0; L]);
        Self {
            registers: empty_rows(),
            x: empty_rows(),
            s: empty_rows(),
            first_rate: empty_rows(),
            stage: empty_rows(),
            sum: empty_rows(),
            gradients: empty_rows(),
            column: empty_rows(),
        }
    }

    /// Creates a block for `seeds` sensitivity columns, with all states 0.
    pub(crate) fn new(system: &System, seeds: usize) -> Self {
        let n = system.states();
        let zeros = |count: usize| filled(count, [0.0; L]);
        let mut registers = zeros(system.layout.registers);
        system
            .layout
            .constants
            .iter()
            .for_each(|(register, value)| registers[*register as usize] = [*value; L]);
        Self {
            registers,
            x: zeros(n),
            s: zeros(n * seeds),
            first_rate: zeros(n),
            stage: zeros(n),
            sum: zeros(n),
            gradients: zeros(if seeds > 0 {
                4 * Slots::new(n, system.rate_gradient.entries.len()).count
            } else {
                0
            }),
            column: zeros(3 * n),
        }
    }

    /// Sets the parameters of one lane (window); [`Block::prepare`] must follow.
    pub(crate) fn set_parameters(&mut self, system: &System, lane: usize, parameters: &[f64]) {
        for (index, value) in parameters.iter().enumerate() {
            self.registers[system.layout.parameter(index)][lane] = *value;
        }
        for (index, value) in system.widths.iter().enumerate() {
            self.registers[system.layout.width(index)][lane] = *value;
        }
    }

    /// Computes the values that depend on parameters alone, after all parameters are set.
    pub(crate) fn prepare(&mut self, system: &System) {
        self.run(system, &system.parameter_section, None);
    }

    /// Runs a section of instructions at the present state.
    pub(crate) fn evaluate(
        &mut self,
        system: &System,
        section: &Section,
        step_inputs: &StepInputs<L>,
        time: &[f64; L],
    ) {
        self.run(system, section, Some((step_inputs, time)));
    }

    /// Computes the outputs at the present state and their derivatives, `[output][seed]`.
    pub(crate) fn measure(
        &mut self,
        system: &System,
        step_inputs: &StepInputs<L>,
        time: &[f64; L],
        columns: &Columns,
        values: &mut [[f64; L]],
        slopes: &mut [[f64; L]],
    ) {
        system.machine.dispatch::<L, _>(Measurement {
            block: self,
            system,
            step_inputs,
            time,
            columns,
            values,
            slopes,
        });
    }

    /// Runs a section of instructions; with `at`, sets states, inputs and time first.
    fn run(&mut self, system: &System, section: &Section, at: Option<(&StepInputs<L>, &[f64; L])>) {
        let Self { registers, x, .. } = self;
        system.machine.dispatch::<L, _>(Evaluation { system, section, registers, x, at });
    }

    /// Takes a classical Runge-Kutta step of length `h` (s) from `time`, for all windows.
    ///
    /// The sensitivities of `columns` are advanced as well.
    ///
    /// The rates of states that are `fixed` are 0.
    pub(crate) fn step(
        &mut self,
        system: &System,
        step_inputs: &StepInputs<L>,
        (time, h): (&[f64; L], &[f64; L]),
        columns: Option<&Columns>,
        fixed: &[bool],
    ) {
        system.machine.dispatch::<L, _>(Step { block: self, system, step_inputs, time, h, columns, fixed });
    }

    /// Advances the states of all windows by a Runge-Kutta step.
    ///
    /// The derivatives of the rates at the four stages are stored for the sensitivities.
    #[inline(always)]
    fn advance_states<S: Simd>(
        &mut self,
        simd: S,
        system: &System,
        step_inputs: &StepInputs<L>,
        (time, h): (&[f64; L], &[f64; L]),
        columns: Option<&Columns>,
        fixed: &[bool],
    ) {
        let n = self.x.len();
        let (section, entries, slots) = match columns {
            Some(columns) => {
                let Gradient { section, entries } = &system.rate_gradient;
                (section, &entries[..], &columns.slots[..])
            }
            None => (&system.rates, &[][..], &[][..]),
        };
        let slots_per_stage = self.gradients.len() / STAGES.len();
        self.stage.copy_from_slice(&self.x);
        let zero_rate = Row([0.0; L]);
        for stage in 0..4 {
            // Stages are at 0, 1/2, 1/2 and 1 of the step, with weights 1, 2, 2 and 1 sixths; `next_at` is
            // where the next one is.
            let (at, next_at, weight) =
                [(0.0, 0.5, 1.0), (0.5, 0.5, 2.0), (0.5, 1.0, 2.0), (1.0, 0.0, 1.0)][stage];
            let mut now = Row([0.0; L]);
            for ((now, h), time) in now.0.iter_mut().zip(h).zip(time) {
                *now = h.mul_add(at, *time);
            }
            self.registers[..n].copy_from_slice(&self.stage);
            step_inputs.set(system, &mut self.registers, &now.0);
            system.machine.pass(simd, section, &mut self.registers);
            for (entry, slot) in entries.iter().zip(slots) {
                self.gradients[stage * slots_per_stage + slot] = self.registers[entry.register];
            }
            for i in 0..n {
                let is_fixed = fixed.get(i) == Some(&true);
                // Used by reference: copying a row would cost as much as the operation that computed it.
                let rate = if is_fixed { &zero_rate.0 } else { &self.registers[section.results[i] as usize] };
                let (sum, next, from) = (&mut self.sum[i], &mut self.stage[i], &self.x[i]);
                if stage == 0 {
                    self.first_rate[i].copy_from_slice(rate);
                    sum.copy_from_slice(rate);
                } else {
                    for lane in 0..L {
                        sum[lane] = rate[lane].mul_add(weight, sum[lane]);
                    }
                }
                if stage < 3 {
                    for lane in 0..L {
                        next[lane] = (h[lane] * next_at).mul_add(rate[lane], from[lane]);
                    }
                }
            }
        }
        for (x, sum) in self.x.iter_mut().zip(self.sum.iter()) {
            for ((x, sum), h) in x.iter_mut().zip(sum).zip(h) {
                *x = (h * (1.0 / 6.0)).mul_add(*sum, *x);
            }
        }
    }

    /// Advances all sensitivity columns by the Runge-Kutta step applied to `S' = J S + P`, formula (2).
    ///
    /// This is the exact derivative of the step of the states.
    #[inline(always)]
    fn advance_sensitivities(&mut self, h: &[f64; L], columns: &Columns, fixed: &[bool]) {
        let n = self.x.len();
        let slots_per_stage = self.gradients.len() / STAGES.len();
        let (mut stage, remaining) = self.column.split_at_mut(n);
        let (mut next, sum) = remaining.split_at_mut(n);
        for (s, direct_slots) in self.s.chunks_exact_mut(n).zip(&columns.direct_slots) {
            stage.copy_from_slice(s);
            for (index, (next_at, weight)) in STAGES.into_iter().enumerate() {
                let gradient = &self.gradients[index * slots_per_stage..(index + 1) * slots_per_stage];
                for i in 0..n {
                    // The rate stays in vector registers while it is summed up and used.
                    let mut rate = gradient[direct_slots[i]];
                    for entry in &columns.rows[i] {
                        let (j, z) = (&gradient[entry.slot], &stage[entry.state]);
                        if entry.is_one {
                            for lane in 0..L {
                                rate[lane] += z[lane];
                            }
                        } else {
                            for lane in 0..L {
                                rate[lane] = j[lane].mul_add(z[lane], rate[lane]);
                            }
                        }
                    }
                    if fixed.get(i) == Some(&true) {
                        rate = [0.0; L];
                    }
                    let (from, to, total) = (&s[i], &mut next[i], &mut sum[i]);
                    for lane in 0..L {
                        let before = if index == 0 { 0.0 } else { total[lane] };
                        total[lane] = rate[lane].mul_add(weight, before);
                        to[lane] = (h[lane] * next_at).mul_add(rate[lane], from[lane]);
                    }
                }
                std::mem::swap(&mut stage, &mut next);
            }
            for i in 0..n {
                let (to, total) = (&mut s[i], &sum[i]);
                for lane in 0..L {
                    to[lane] = (h[lane] * (1.0 / 6.0)).mul_add(total[lane], to[lane]);
                }
            }
        }
    }

    /// Computes the derivatives, for one seed and lane, of values whose gradient was just evaluated.
    ///
    /// They are `g_x S + g_p` (S the sensitivities of the states), one per value.
    pub(crate) fn directional_derivatives(
        &self,
        gradient: &Gradient,
        columns: &Columns,
        seed: usize,
        lane: usize,
        into: &mut [f64],
    ) {
        let n = self.x.len();
        into.fill(0.0);
        for entry in &gradient.entries {
            let factor = match entry.column {
                Column::State(state) => self.s[seed * n + state][lane],
                Column::Active(k) if columns.active[seed] == Some(k) => 1.0,
                _ => continue,
            };
            if let Some(to) = into.get_mut(entry.row) {
                *to = self.registers[entry.register][lane].mul_add(factor, *to);
            }
        }
    }
}
