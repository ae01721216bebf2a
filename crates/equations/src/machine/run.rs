//! Runs a list of instructions, each as a loop over lanes (simulated windows).
//!
//! The loops are compiled to vector code for the instruction set found at run time.

use super::evaluate;
use crate::compile::{Code, Section};
use crate::external::ExternalFunction;
use crate::model::{Model, Table};
use pulp::{Arch, Simd, WithSimd};

/// Registers of a block of windows: each holds one number for each of `L` lanes.
pub(crate) type Registers<const L: usize> = [[f64; L]];

/// The instruction set found at run time, and the tables of a compiled system.
#[derive(Debug, Clone)]
pub(crate) struct Machine {
    pub(crate) arch: Arch,
    pub(crate) tables: Vec<Table>,
    /// Function outside the engine that computes rates; `None` if the system has none.
    pub(crate) external: Option<ExternalFunction>,
}

impl Machine {
    /// Finds the instruction set of this computer, and takes tables and external function of a model.
    pub(crate) fn new(model: &Model) -> Self {
        let external = model.external.as_ref().and_then(|external| external.rates.clone());
        Machine { arch: Arch::new(), tables: model.tables.clone(), external }
    }

    /// Runs `work` on blocks of `L` windows, with code for the best instruction set of this computer.
    ///
    /// Fewer than 8 lanes do not fill a vector of AVX-512, so they run on AVX2 there as well. The results
    /// have the same bits, and no code is compiled that would bring no gain.
    pub(crate) fn dispatch<const L: usize, W: WithSimd>(&self, work: W) -> W::Output {
        #[cfg(target_arch = "x86_64")]
        if const { L < 8 } {
            return match pulp::x86::V3::try_new() {
                Some(simd) if !matches!(self.arch, Arch::Scalar) => Simd::vectorize(simd, work),
                _ => Simd::vectorize(pulp::Scalar, work),
            };
        }
        self.arch.dispatch(work)
    }

    /// Runs the instructions of `section` on `registers`, with code for the instruction set `simd`.
    ///
    /// Never inlined: it has a loop for each of 28 operations, with the elementary functions inside. The
    /// compiler would otherwise build it once for each caller, number of lanes and instruction set (54
    /// copies) instead of 18 times.
    #[inline(never)]
    pub(crate) fn pass<S: Simd, const L: usize>(
        &self,
        simd: S,
        section: &Section,
        registers: &mut Registers<L>,
    ) {
        let external = self.external.as_ref();
        simd.vectorize(Pass { tables: &self.tables, external, section, registers });
    }
}

/// One run over the instructions of a section, in the form that [`pulp`] dispatches to an instruction set.
struct Pass<'p, const L: usize> {
    tables: &'p [Table],
    external: Option<&'p ExternalFunction>,
    section: &'p Section,
    registers: &'p mut Registers<L>,
}

impl<const L: usize> WithSimd for Pass<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self { tables, external, section, registers } = self;
        for instruction in &section.body {
            if instruction.code == Code::External {
                if let (Some(function), Some(call)) =
                    (external, section.calls.get(instruction.table as usize))
                {
                    super::external::call(function, call, registers);
                }
                continue;
            }
            // A result has a higher register than its operands, so that it can be written while they are
            // read.
            let (before, after) = registers.split_at_mut(instruction.to as usize);
            let Some(to) = after.first_mut() else { continue };
            let [a, b, c] = instruction.operands;
            let (Some(a), Some(b), Some(c)) =
                (before.get(a as usize), before.get(b as usize), before.get(c as usize))
            else {
                continue;
            };
            macro_rules! table {
                ($function:expr) => {
                    for lane in 0..L {
                        to[lane] =
                            tables.get(instruction.table as usize).map_or(0.0, |t| $function(t, a[lane]));
                    }
                };
            }
            macro_rules! arms {
                ($($name:ident),*) => {
                    match instruction.code {
                        $(Code::$name => for lane in 0..L {
                            to[lane] = evaluate(Code::$name, a[lane], b[lane], c[lane]);
                        })*
                        Code::Table => table!(Table::value),
                        Code::TableSlope => table!(Table::slope),
                        Code::Constant | Code::State | Code::Input | Code::InputSlope | Code::Time
                        | Code::Parameter | Code::Width | Code::Argument | Code::External
                        | Code::ExternalDerivative => {}
                    }
                };
            }
            arms!(
                Add,
                Subtract,
                Multiply,
                Divide,
                Negate,
                MultiplyAdd,
                MultiplySubtract,
                SubtractProduct,
                Minimum,
                Maximum,
                Absolute,
                Select,
                Sqrt,
                Cbrt,
                Exp,
                Ln,
                Sin,
                Cos,
                Tan,
                Asin,
                Acos,
                Atan,
                Sinh,
                Cosh,
                Tanh,
                Atan2,
                Hypot,
                Power
            );
        }
    }
}

impl Table {
    /// Index of the knot before `x`; `None` if `x` is outside the knots.
    fn piece(&self, x: f64) -> Option<usize> {
        let after = self.at.partition_point(|knot| *knot <= x);
        (after > 0 && after < self.at.len()).then(|| after - 1)
    }

    /// Value of the table at `x`: linear between the knots, constant outside.
    pub(crate) fn value(&self, x: f64) -> f64 {
        match self.piece(x) {
            Some(i) => {
                let share = (x - self.at[i]) / (self.at[i + 1] - self.at[i]);
                (self.values[i + 1] - self.values[i]).mul_add(share, self.values[i])
            }
            None if x.is_nan() => x,
            None if self.at.first().is_some_and(|first| x < *first) => {
                self.values.first().copied().unwrap_or(0.0)
            }
            None => self.values.last().copied().unwrap_or(0.0),
        }
    }

    /// Slope of the table at `x`; 0 outside the knots.
    pub(crate) fn slope(&self, x: f64) -> f64 {
        self.piece(x).map_or(0.0, |i| (self.values[i + 1] - self.values[i]) / (self.at[i + 1] - self.at[i]))
    }
}
