//! How finely to step, and how wide to smooth: chosen before a fit from simulations at its start.

use super::block::{Block, Drive};
use super::implicit::linearise;
use super::simulate::jump_sizes;
use super::{Method, Options, SimulationError, Window};
use crate::limits::SUBSTEPS;
use crate::model::Integrator;
use crate::system::System;

/// Outputs may move by this share of their scale, root mean square, when the number of steps is doubled.
const ACCEPTED: f64 = 0.01;
/// A single output may move by this share of its scale.
const ACCEPTED_ONCE: f64 = 0.1;
/// The stability limit of classical Runge-Kutta on the negative axis is 2.79; with less the step is stable but no longer
/// accurate.
const STABLE: f64 = 2.5;
/// Width of a smoothed jump as a share of the root mean square of what jumps.
const WIDTH_SHARE: f64 = 0.01;

/// A choice of steps.
#[derive(Debug, Clone, PartialEq)]
pub struct ChosenSteps {
    /// Method and steps of a sample interval.
    pub options: Options,
    /// Root mean square change of the outputs over their scales when the steps were doubled.
    pub change: f64,
}

/// By how much outputs move, in units of their scales; no number where one of them is none.
#[derive(Clone, Copy)]
pub(crate) struct Change {
    pub(crate) root_mean_square: f64,
    largest: f64,
}

impl Change {
    /// That of a simulation that fails.
    pub(crate) const ENDLESS: Self = Self { root_mean_square: f64::INFINITY, largest: f64::INFINITY };

    /// The difference of two simulations with these scales of their outputs.
    pub(crate) fn of(a: &[f64], b: &[f64], scales: &[f64]) -> Self {
        let each = a.iter().zip(b).zip(scales.iter().cycle()).map(|((a, b), scale)| (a - b).abs() / scale);
        let worse = |worst: f64, x: f64| if x > worst || x.is_nan() { x } else { worst };
        let (squares, largest) = each.fold((0.0, 0.0), |(sum, most), x| (sum + x * x, worse(most, x)));
        Self { root_mean_square: (squares / a.len().max(1) as f64).sqrt(), largest }
    }

    /// Whether it is so small that the two are the same simulation.
    pub(crate) fn is_accepted(self) -> bool {
        self.root_mean_square <= ACCEPTED && self.largest <= ACCEPTED_ONCE
    }
}

impl System {
    /// The smallest number of steps (1, 2, 4, … 64) at which outputs move by less than a hundredth of their scale, root mean square, and
    /// none by more than a tenth, when it is doubled; or the number that the file states. `scales` has one positive value an output, such
    /// as the standard deviation of its sensor.
    ///
    /// # Errors
    /// [`SimulationError::Stiff`] if 64 steps are too few because a rate is too fast for them; any other error of the
    /// simulation with 64 steps.
    pub fn choose_steps(
        &self,
        windows: &[Window<'_>],
        scales: &[f64],
    ) -> Result<ChosenSteps, SimulationError> {
        let method = self.declared_method();
        let run = |substeps: usize| -> Result<Vec<f64>, SimulationError> {
            let results = self.simulate(windows, &[], &Options { method, substeps });
            let values: Result<Vec<_>, _> = results.into_iter().map(|r| r.map(|s| s.values)).collect();
            Ok(values?.concat())
        };
        let change = |a: &[f64], b: &[f64]| Change::of(a, b, scales);
        if let Some(substeps) = self.model.numerics.substeps {
            let change = change(&run(substeps)?, &run(2 * substeps)?);
            return Ok(ChosenSteps {
                options: Options { method, substeps },
                change: change.root_mean_square,
            });
        }
        let mut coarse = run(1);
        let mut substeps = 1;
        loop {
            let fine = run(2 * substeps);
            let moved = match (&coarse, &fine) {
                (Ok(coarse), Ok(fine)) => change(coarse, fine),
                _ => Change::ENDLESS,
            };
            let chosen =
                ChosenSteps { options: Options { method, substeps }, change: moved.root_mean_square };
            if moved.is_accepted() {
                return Ok(chosen);
            }
            if substeps >= SUBSTEPS {
                if method == Method::RungeKutta {
                    self.refuse_stiff(windows)?;
                }
                coarse?;
                return Ok(chosen);
            }
            (coarse, substeps) = (fine, 2 * substeps);
        }
    }

    /// The method that the file asks for.
    pub fn declared_method(&self) -> Method {
        match self.model.numerics.integrator {
            Integrator::Explicit => Method::RungeKutta,
            Integrator::Implicit => Method::Implicit,
        }
    }

    /// Widths of smoothed jumps that the file leaves open become 1 % of the root mean square of what jumps, in a
    /// simulation of `windows`; where it never moves they stay.
    ///
    /// # Errors
    /// The first error of the simulation.
    pub fn fit_widths(&mut self, windows: &[Window<'_>], options: &Options) -> Result<(), SimulationError> {
        // A width changes what is simulated, which changes the width; the second round settles it to a few percent.
        for _ in 0..2 {
            let sizes = jump_sizes(self, windows, options)?;
            for ((width, declared), size) in self.widths.iter_mut().zip(&self.declared_widths).zip(sizes) {
                if !declared && size > 0.0 && size.is_finite() {
                    *width = WIDTH_SHARE * size;
                }
            }
        }
        Ok(())
    }

    /// Refuses a system whose fastest rate is too fast for 64 steps of a sample interval at the windows' starts.
    fn refuse_stiff(&self, windows: &[Window<'_>]) -> Result<(), SimulationError> {
        let n = self.states();
        for window in windows.iter().take(64) {
            let times = &window.record.times[window.first..=window.last];
            let Some(interval) = times.windows(2).map(|pair| pair[1] - pair[0]).reduce(f64::max) else {
                continue;
            };
            let mut block = Block::<1>::new(self, 0);
            block.set_parameters(self, 0, window.parameters);
            block.prepare(self);
            block.x.iter_mut().zip(window.start).for_each(|(to, x)| to[0] = *x);
            let mut drive = Drive::<1>::new(self.model.inputs.len());
            drive.begin[0] = times[0];
            for (c, signal) in drive.coefficients.iter_mut().zip(&window.record.inputs) {
                c[0][0] = signal.at(times[0]);
            }
            let (_, jacobian) = linearise(&mut block, self, &drive, times[0], &vec![false; n]);
            let (rate, state) = fastest(&jacobian, n);
            if rate * interval > STABLE * SUBSTEPS as f64 {
                let state = self.model.states[state].name.clone();
                return Err(SimulationError::Stiff { state, rate, ratio: rate * interval });
            }
        }
        Ok(())
    }
}

/// Spectral radius of a matrix and the row that its fastest mode moves most, by Gelfand's formula: the norm of the 64th
/// power to the 64th root, within some percent also where eigenvalues are complex.
pub(crate) fn fastest(jacobian: &[f64], n: usize) -> (f64, usize) {
    let mut power = jacobian.to_vec();
    let mut exponent = 1.0;
    let mut logarithm = 0.0_f64;
    for _ in 0..=6 {
        let norm = power.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
        if norm == 0.0 || !norm.is_finite() {
            return (norm, 0);
        }
        logarithm += norm.ln() / exponent;
        power.iter_mut().for_each(|x| *x /= norm);
        let mut square = vec![0.0; n * n];
        for (i, row) in square.chunks_exact_mut(n).enumerate() {
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
