//! States of `L` windows side by side, and the step of Runge and Kutta with the equation of their sensitivities.

use super::Seed;
use super::rows::{OnLines, Row, Rows, filled};
use super::sensitivity::{STAGES, Slots, advance};
use crate::compile::Section;
use crate::system::{Column, Entry, Gradient, System};
use pulp::{Simd, WithSimd};

/// The inputs of a step, lane by lane: cubics in the time since the begin of a piece.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct Drive<const L: usize> {
    /// Time at the begin of the piece.
    pub(crate) begin: [f64; L],
    /// `[input][power]`.
    pub(crate) coefficients: OnLines<[[f64; L]; 4]>,
}

/// `L` windows: registers of the machine, state and sensitivities, and scratch that is used again and again.
#[derive(Debug, Clone)]
pub(crate) struct Block<const L: usize> {
    pub(crate) registers: Rows<L>,
    /// `[state]`.
    pub(crate) x: Rows<L>,
    /// `[seed][state]`.
    pub(crate) s: Rows<L>,
    /// Rates at the begin of the last step.
    pub(crate) first_rate: Rows<L>,
    stage: Rows<L>,
    sum: Rows<L>,
    /// Derivatives of the rates at the four stages, `[stage][slot]`.
    gradients: Rows<L>,
    column: Rows<L>,
}

/// Columns of the sensitivities: what each seed contributes to the rates.
#[derive(Debug, Clone, Default)]
pub(crate) struct Columns {
    pub(crate) seeds: Vec<Seed>,
    /// Active parameter of each seed.
    pub(crate) active: Vec<Option<usize>>,
    /// Slot of each entry of the rates' gradient.
    slots: Vec<usize>,
    /// Derivatives of each rate with respect to states.
    rows: Vec<Vec<RowEntry>>,
    /// Slot of the derivative of each rate by the seed itself, by seed.
    own: Vec<Vec<usize>>,
}

#[derive(Debug, Clone, Copy)]
struct RowEntry {
    slot: usize,
    state: usize,
    is_one: bool,
}

/// A section at one state, as work for the instruction set found at run time. A closure in its place would stay a
/// function of its own, compiled for the lowest set.
struct Evaluation<'e, const L: usize> {
    system: &'e System,
    section: &'e Section,
    registers: &'e mut [[f64; L]],
    x: &'e [[f64; L]],
    at: Option<(&'e Drive<L>, &'e [f64; L])>,
}

impl<const L: usize> WithSimd for Evaluation<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        if let Some((drive, time)) = self.at {
            self.registers[..self.x.len()].copy_from_slice(self.x);
            drive.set(self.system, self.registers, time);
        }
        self.system.machine.pass(simd, self.section, self.registers);
    }
}

/// Outputs and their derivatives at one state, as work for the instruction set.
struct Measurement<'m, const L: usize> {
    block: &'m mut Block<L>,
    system: &'m System,
    drive: &'m Drive<L>,
    time: &'m [f64; L],
    columns: &'m Columns,
    values: &'m mut [[f64; L]],
    slopes: &'m mut [[f64; L]],
}

impl<const L: usize> WithSimd for Measurement<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { block, system, drive, time, columns, values, slopes } = self;
        let (gradient, n, seeds) = (&system.output_gradient, block.x.len(), columns.seeds.len());
        let section = if seeds == 0 { &system.outputs } else { &gradient.section };
        block.registers[..n].copy_from_slice(&block.x);
        drive.set(system, &mut block.registers, time);
        system.machine.pass(simd, section, &mut block.registers);
        for (to, result) in values.iter_mut().zip(&section.results) {
            *to = block.registers[*result as usize];
        }
        slopes.fill([0.0; L]);
        for (seed, active) in columns.active.iter().enumerate() {
            for entry in &gradient.entries {
                let to = &mut slopes[entry.row * seeds + seed];
                let g = &block.registers[entry.register];
                match entry.column {
                    Column::State(state) => {
                        let s = &block.s[seed * n + state];
                        for lane in 0..L {
                            to[lane] = g[lane].mul_add(s[lane], to[lane]);
                        }
                    }
                    Column::Active(k) if *active == Some(k) => {
                        for lane in 0..L {
                            to[lane] += g[lane];
                        }
                    }
                    _ => {}
                }
            }
        }
    }
}

/// A step of Runge-Kutta, as work for the instruction set.
struct Step<'s, const L: usize> {
    block: &'s mut Block<L>,
    system: &'s System,
    drive: &'s Drive<L>,
    time: &'s [f64; L],
    h: &'s [f64; L],
    columns: Option<&'s Columns>,
    held: &'s [bool],
}

impl<const L: usize> WithSimd for Step<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.block.values(simd, self.system, self.drive, (self.time, self.h), self.columns, self.held);
        if let Some(columns) = self.columns {
            let Block { x, s, gradients, .. } = &mut *self.block;
            let is_free = !self.held.contains(&true);
            if !(is_free && advance(simd, &columns.own, self.h, gradients, s, x.len())) {
                self.block.sensitivities(self.h, columns, self.held);
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
        let places = Slots::new(n, entries.len());
        let slot = |(index, entry): (usize, &Entry)| match entry.column {
            Column::State(state) if places.dense > 0 => entry.row * n + state,
            _ => places.dense + index,
        };
        let slots: Vec<usize> = entries.iter().enumerate().map(slot).collect();
        let active: Vec<Option<usize>> = seeds.iter().map(active).collect();
        let mut rows = vec![Vec::new(); n];
        let mut own = vec![vec![places.zero(); n]; seeds.len()];
        for (entry, slot) in entries.iter().zip(&slots) {
            match entry.column {
                Column::State(state) => {
                    rows[entry.row].push(RowEntry { slot: *slot, state, is_one: entry.is_one });
                }
                Column::Active(k) => {
                    let of_seed = own.iter_mut().zip(&active).filter(|(_, active)| **active == Some(k));
                    of_seed.for_each(|(own, _)| own[entry.row] = *slot);
                }
                Column::Time => {}
            }
        }
        Columns { seeds: seeds.to_vec(), active, slots, rows, own }
    }
}

impl<const L: usize> Drive<L> {
    pub(crate) fn new(inputs: usize) -> Self {
        Self { coefficients: filled(inputs, [[0.0; L]; 4]), begin: [0.0; L] }
    }

    /// Sets time and inputs at `time`.
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
            if !layout.needs_slopes {
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
    /// Stands in the place of a block that was taken out.
    pub(crate) fn empty() -> Self {
        let none = || filled(0, [0.0; L]);
        Self {
            registers: none(),
            x: none(),
            s: none(),
            first_rate: none(),
            stage: none(),
            sum: none(),
            gradients: none(),
            column: none(),
        }
    }

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

    /// Sets the parameters of a lane; [`Block::prepare`] must follow.
    pub(crate) fn set_parameters(&mut self, system: &System, lane: usize, parameters: &[f64]) {
        for (index, value) in parameters.iter().enumerate() {
            self.registers[system.layout.parameter(index)][lane] = *value;
        }
        for (index, value) in system.widths.iter().enumerate() {
            self.registers[system.layout.width(index)][lane] = *value;
        }
    }

    /// Computes what depends on parameters alone.
    pub(crate) fn prepare(&mut self, system: &System) {
        self.run(system, &system.once, None);
    }

    /// Runs a section at the present state.
    pub(crate) fn evaluate(&mut self, system: &System, section: &Section, drive: &Drive<L>, time: &[f64; L]) {
        self.run(system, section, Some((drive, time)));
    }

    /// Outputs at the present state and their derivatives, `[output][seed]`.
    pub(crate) fn measure(
        &mut self,
        system: &System,
        drive: &Drive<L>,
        time: &[f64; L],
        columns: &Columns,
        values: &mut [[f64; L]],
        slopes: &mut [[f64; L]],
    ) {
        system.machine.dispatch::<L, _>(Measurement {
            block: self,
            system,
            drive,
            time,
            columns,
            values,
            slopes,
        });
    }

    fn run(&mut self, system: &System, section: &Section, at: Option<(&Drive<L>, &[f64; L])>) {
        let Self { registers, x, .. } = self;
        system.machine.dispatch::<L, _>(Evaluation { system, section, registers, x, at });
    }

    /// A step of classical Runge-Kutta from `time` of length `h`, with the sensitivities of `columns` if given. Rates of
    /// states that are `held` are 0.
    pub(crate) fn step(
        &mut self,
        system: &System,
        drive: &Drive<L>,
        (time, h): (&[f64; L], &[f64; L]),
        columns: Option<&Columns>,
        held: &[bool],
    ) {
        system.machine.dispatch::<L, _>(Step { block: self, system, drive, time, h, columns, held });
    }

    #[inline(always)]
    fn values<S: Simd>(
        &mut self,
        simd: S,
        system: &System,
        drive: &Drive<L>,
        (time, h): (&[f64; L], &[f64; L]),
        columns: Option<&Columns>,
        held: &[bool],
    ) {
        let n = self.x.len();
        let (section, entries, slots) = match columns {
            Some(columns) => {
                let Gradient { section, entries } = &system.rate_gradient;
                (section, &entries[..], &columns.slots[..])
            }
            None => (&system.rates, &[][..], &[][..]),
        };
        let of_stage = self.gradients.len() / STAGES.len();
        self.stage.copy_from_slice(&self.x);
        let still = Row([0.0; L]);
        for stage in 0..4 {
            // Stages at 0, 1/2, 1/2 and 1 of the step; each goes on by 1/2, 1/2, 1 and weighs 1, 2, 2, 1 sixths.
            let (at, on, weight) =
                [(0.0, 0.5, 1.0), (0.5, 0.5, 2.0), (0.5, 1.0, 2.0), (1.0, 0.0, 1.0)][stage];
            let mut now = Row([0.0; L]);
            for ((now, h), time) in now.0.iter_mut().zip(h).zip(time) {
                *now = h.mul_add(at, *time);
            }
            self.registers[..n].copy_from_slice(&self.stage);
            drive.set(system, &mut self.registers, &now.0);
            system.machine.pass(simd, section, &mut self.registers);
            for (entry, slot) in entries.iter().zip(slots) {
                self.gradients[stage * of_stage + slot] = self.registers[entry.register];
            }
            for i in 0..n {
                let is_held = held.get(i) == Some(&true);
                // Read where it stands: a copy of a row on the way costs as much as the operation that made it.
                let rate = if is_held { &still.0 } else { &self.registers[section.results[i] as usize] };
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
                        next[lane] = (h[lane] * on).mul_add(rate[lane], from[lane]);
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

    /// Makes the step of the values on the equation S' = J S + P of each column too: the exact derivative of that step.
    #[inline(always)]
    fn sensitivities(&mut self, h: &[f64; L], columns: &Columns, held: &[bool]) {
        let n = self.x.len();
        let of_stage = self.gradients.len() / STAGES.len();
        let (mut stage, rest) = self.column.split_at_mut(n);
        let (mut next, sum) = rest.split_at_mut(n);
        for (s, own) in self.s.chunks_exact_mut(n).zip(&columns.own) {
            stage.copy_from_slice(s);
            for (index, (on, weight)) in STAGES.into_iter().enumerate() {
                let gradient = &self.gradients[index * of_stage..(index + 1) * of_stage];
                for i in 0..n {
                    // The rate stays in registers from its first part to its use.
                    let mut rate = gradient[own[i]];
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
                    if held.get(i) == Some(&true) {
                        rate = [0.0; L];
                    }
                    let (from, to, total) = (&s[i], &mut next[i], &mut sum[i]);
                    for lane in 0..L {
                        let before = if index == 0 { 0.0 } else { total[lane] };
                        total[lane] = rate[lane].mul_add(weight, before);
                        to[lane] = (h[lane] * on).mul_add(rate[lane], from[lane]);
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

    /// Derivatives along a column of values whose gradient was just evaluated: `g_x S + g_p`, by value.
    pub(crate) fn along(
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
