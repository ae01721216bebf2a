//! Simulates windows in blocks of SIMD lanes; each result is the same as if the window were simulated alone.

use super::block::Columns;
use super::run::Run;
use super::{Options, Seed, Simulated, SimulationError, Window};
use crate::system::System;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// Default number of windows per block; in large blocks more windows share the cost of decoding each operation.
const DEFAULT_LANES: usize = 32;
/// Number of windows per block without sensitivities, if there are enough windows for every thread.
///
/// Without sensitivities the registers of a window are few, so more lanes fit into the first-level cache.
const WIDE_LANES: usize = 64;
/// Number of windows per block with sensitivities, if there are too few windows for larger blocks.
///
/// Larger blocks would leave threads idle.
const NARROW_LANES: usize = 16;
/// Number of windows up to which a small block is faster than a large one that is mostly padding.
///
/// It is the number of lanes of the widest vector. Fewer windows take as long, and their sensitivities no
/// longer stay in registers.
const SMALL_LANES: usize = 8;
/// Number of windows of the smallest block, for instruction sets with four lanes or fewer.
///
/// This block is used if there are no more windows than that.
const SMALLEST_LANES: usize = 4;

/// Integration method of a simulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Classical Runge-Kutta of order 4 with equal steps; more steps where a fast mode would be unstable.
    RungeKutta,
    /// Classical Runge-Kutta with exactly the given number of steps, to find out how many are accurate.
    UncheckedRungeKutta,
    /// Explicit Euler with steps of about this length, for a function that advances the states by such steps.
    Euler {
        /// Length of a step, s; an interval between samples has a whole number of steps.
        step_s: f64,
    },
    /// Diagonally implicit Runge-Kutta of order 2 with steps of fixed number, for stiff systems.
    Implicit,
    /// Dormand-Prince 5(4) with adaptive steps, values only: slow, to check the other methods against.
    Reference {
        /// Allowed error per step, relative to the size of the state.
        tolerance: f64,
    },
}

impl Method {
    /// Whether the steps are explicit and of fixed number, so that all windows of a block can take them together.
    pub(crate) fn is_explicit(self) -> bool {
        matches!(self, Method::RungeKutta | Method::UncheckedRungeKutta | Method::Euler { .. })
    }
}

/// Finds the number of doubles in a vector of the instruction set of this computer.
struct VectorLanes;

impl WithSimd for VectorLanes {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> usize {
        S::F64_LANES
    }
}

impl System {
    /// Simulates windows, with derivatives of the outputs with respect to `seeds`.
    ///
    /// The result of a window is bit-identical whatever the other windows, their order and the number of
    /// threads.
    ///
    /// # Errors
    /// Each window has its own result, with its own [`SimulationError`].
    pub fn simulate(
        &self,
        windows: &[Window<'_>],
        seeds: &[Seed],
        options: &Options,
    ) -> Vec<Result<Simulated, SimulationError>> {
        if self.states() == 0 {
            return self.outputs_without_states(windows, seeds, options);
        }
        self.run_windows(windows, seeds, options)
    }

    /// Simulates windows in blocks, as they are.
    pub(super) fn run_windows(
        &self,
        windows: &[Window<'_>],
        seeds: &[Seed],
        options: &Options,
    ) -> Vec<Result<Simulated, SimulationError>> {
        let columns = Columns::new(self, seeds);
        let vector = self.machine.arch.dispatch(VectorLanes);
        let run = |windows: &[Window<'_>]| match windows {
            [_] if seeds.is_empty() => Run::<1>::new(self, windows, &columns, options).run(),
            windows if windows.len() <= SMALLEST_LANES && vector <= SMALLEST_LANES => {
                Run::<SMALLEST_LANES>::new(self, windows, &columns, options).run()
            }
            windows if windows.len() <= SMALL_LANES => {
                Run::<SMALL_LANES>::new(self, windows, &columns, options).run()
            }
            windows if windows.len() <= NARROW_LANES && !seeds.is_empty() => {
                Run::<NARROW_LANES>::new(self, windows, &columns, options).run()
            }
            windows if windows.len() <= DEFAULT_LANES => {
                Run::<DEFAULT_LANES>::new(self, windows, &columns, options).run()
            }
            _ => Run::<WIDE_LANES>::new(self, windows, &columns, options).run(),
        };
        let fill_all_threads = |lanes: usize| windows.len() >= lanes * rayon::current_num_threads();
        let lanes = match seeds.is_empty() {
            true if fill_all_threads(WIDE_LANES) => WIDE_LANES,
            false if !fill_all_threads(DEFAULT_LANES) => NARROW_LANES,
            _ => DEFAULT_LANES,
        };
        windows.par_chunks(lanes).flat_map_iter(run).collect()
    }

    /// Simulates all states at all samples of a window, `[sample][state]`.
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

    /// Determines why a window does not fit this system or these seeds; `None` if it does.
    pub(super) fn validate(&self, window: &Window<'_>, seeds: &[Seed]) -> Option<SimulationError> {
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

/// Root mean square of the argument of each smoothed discontinuity, over the samples of `windows`.
///
/// # Errors
/// The first error of the simulation.
pub(crate) fn discontinuity_sizes(
    system: &System,
    windows: &[Window<'_>],
    options: &Options,
) -> Result<Vec<f64>, SimulationError> {
    let columns = Columns::new(system, &[]);
    let mut sums = vec![0.0; system.widths.len()];
    let mut samples = 0;
    for window in windows {
        let mut run = Run::<1>::new(system, std::slice::from_ref(window), &columns, options);
        run.discontinuity_squares = Some((vec![0.0; sums.len()], 0));
        let recorded = run.advance_all();
        if let Some(failure) = run.failures.into_iter().flatten().next() {
            return Err(failure);
        }
        let (squares, count) = recorded.unwrap_or_default();
        sums.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
        samples += count;
    }
    Ok(sums.into_iter().map(|sum: f64| (sum / f64::from(samples.max(1))).sqrt()).collect())
}
