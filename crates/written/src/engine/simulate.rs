//! Windows in, outputs and their derivatives out: blocks of lanes in the order of the windows, each lane as if it were
//! alone.

use super::block::Columns;
use super::run::Run;
use super::{Options, Seed, Simulated, SimulationError, Window};
use crate::system::System;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// Windows side by side: more share the cost of finding each operation.
const LANES: usize = 32;
/// Windows side by side without sensitivities, whose registers leave room for more in the first-level cache, where there are enough
/// to keep every thread busy.
const WIDE: usize = 64;
/// Windows side by side with sensitivities, where there are not enough to keep every thread busy with wider blocks.
const NARROW: usize = 16;
/// Windows up to which a narrow block is quicker than a wide one that is mostly padding: long windows are few. As many as the
/// widest vector has lanes: fewer take as long, and their sensitivities leave the registers.
const FEW: usize = 8;

/// Windows that a block for vectors of four lanes holds: no set of vectors is quicker with more where there are as few.
const FEWEST: usize = 4;

/// Method of integration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Classical Runge-Kutta of order 4 in fixed steps.
    RungeKutta,
    /// Diagonally implicit Runge-Kutta of order 2 in fixed steps, for stiff systems.
    Implicit,
    /// Dormand-Prince 5(4) with steps of its own choice, values only: slow, to check the others against.
    Reference {
        /// Error that a step may make, relative to the state.
        tolerance: f64,
    },
}

/// The number of doubles that a vector of the instruction set found at run time holds.
struct VectorLanes;

impl WithSimd for VectorLanes {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> usize {
        S::F64_LANES
    }
}

impl System {
    /// Simulates windows with derivatives with respect to `seeds`. The result of a window does not depend on the others,
    /// on their order, or on the number of threads, to the last bit.
    ///
    /// # Errors
    /// Of each window its own [`SimulationError`].
    pub fn simulate(
        &self,
        windows: &[Window<'_>],
        seeds: &[Seed],
        options: &Options,
    ) -> Vec<Result<Simulated, SimulationError>> {
        let columns = Columns::new(self, seeds);
        let vector = self.machine.arch.dispatch(VectorLanes);
        let run = |windows: &[Window<'_>]| match windows {
            [_] if seeds.is_empty() => Run::<1>::new(self, windows, &columns, options).run(),
            few if few.len() <= FEWEST && vector <= FEWEST => {
                Run::<FEWEST>::new(self, windows, &columns, options).run()
            }
            few if few.len() <= FEW => Run::<FEW>::new(self, windows, &columns, options).run(),
            some if some.len() <= NARROW && !seeds.is_empty() => {
                Run::<NARROW>::new(self, windows, &columns, options).run()
            }
            some if some.len() <= LANES => Run::<LANES>::new(self, windows, &columns, options).run(),
            _ => Run::<WIDE>::new(self, windows, &columns, options).run(),
        };
        let are_many = |lanes: usize| windows.len() >= lanes * rayon::current_num_threads();
        let lanes = match seeds.is_empty() {
            true if are_many(WIDE) => WIDE,
            false if !are_many(LANES) => NARROW,
            _ => LANES,
        };
        windows.par_chunks(lanes).flat_map_iter(run).collect()
    }

    /// All states at all samples of a window, `[sample][state]`.
    ///
    /// # Errors
    /// Those of [`System::simulate`].
    pub fn states_along(&self, window: &Window<'_>, options: &Options) -> Result<Vec<f64>, SimulationError> {
        let columns = Columns::new(self, &[]);
        let mut run = Run::<1>::new(self, std::slice::from_ref(window), &columns, options);
        run.states = Some(Vec::new());
        run.advance_all();
        match run.failures.into_iter().flatten().next() {
            Some(failure) => Err(failure),
            None => Ok(run.states.unwrap_or_default()),
        }
    }

    pub(super) fn objection(&self, window: &Window<'_>, seeds: &[Seed]) -> Option<SimulationError> {
        let record = window.record;
        let name = || record.name.clone();
        let samples = record.times.len();
        if window.first > window.last || window.last >= samples {
            let (first, last) = (window.first, window.last);
            return Some(SimulationError::Samples { record: name(), first, last, samples });
        }
        let model = &self.model;
        for (what, found, expected) in [
            ("start", window.start.len(), model.states.len()),
            ("parameters", window.parameters.len(), model.parameters.len()),
            ("inputs", record.inputs.len(), model.inputs.len()),
        ] {
            if found != expected {
                return Some(SimulationError::Size { record: name(), what, found, expected });
            }
        }
        seeds.iter().find_map(|seed| match seed {
            Seed::Parameter(p) if !self.active.contains(p) => {
                let name = model.parameters.get(*p).map_or_else(|| p.to_string(), |p| p.name.clone());
                Some(SimulationError::NotActive { name })
            }
            Seed::Start(state) if *state >= model.states.len() => {
                let (found, expected) = (*state + 1, model.states.len());
                Some(SimulationError::Size { record: name(), what: "start", found, expected })
            }
            _ => None,
        })
    }
}

/// Root mean square of the argument of each smoothed jump over the samples of `windows`.
///
/// # Errors
/// The first error of the simulation.
pub(crate) fn jump_sizes(
    system: &System,
    windows: &[Window<'_>],
    options: &Options,
) -> Result<Vec<f64>, SimulationError> {
    let columns = Columns::new(system, &[]);
    let mut sums = vec![0.0; system.widths.len()];
    let mut samples = 0;
    for window in windows {
        let mut run = Run::<1>::new(system, std::slice::from_ref(window), &columns, options);
        run.jumps = Some((vec![0.0; sums.len()], 0));
        let measured = run.advance_all();
        if let Some(failure) = run.failures.into_iter().flatten().next() {
            return Err(failure);
        }
        let (squares, count) = measured.unwrap_or_default();
        sums.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
        samples += count;
    }
    Ok(sums.into_iter().map(|sum: f64| (sum / f64::from(samples.max(1))).sqrt()).collect())
}
