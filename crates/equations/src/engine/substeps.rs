//! Chooses the number of steps and the widths of smoothed discontinuities before a fit.

use super::block::{Block, StepInputs};
use super::implicit::linearise;
use super::simulate::discontinuity_sizes;
use super::{Method, Options, SimulationError, Window};
use crate::limits::MAX_SUBSTEPS;
use crate::model::Integrator;
use crate::system::System;

/// Maximum root mean square change of the outputs when the number of steps is doubled.
///
/// In units of the scales of the outputs.
const MAX_RMS_CHANGE: f64 = 0.01;
/// Maximum change of a single output value, in units of its scale.
const MAX_SINGLE_CHANGE: f64 = 0.1;
/// Maximum product of the fastest rate and the step length for explicit steps.
///
/// The stability limit of classical Runge-Kutta on the negative real axis is 2.79; close to it the step is
/// stable but not accurate.
const STABILITY_LIMIT: f64 = 2.5;
/// Width of a smoothed discontinuity as a share of the root mean square of its argument.
const WIDTH_RATIO: f64 = 0.01;

/// Chosen steps, and how much the outputs change with finer ones.
#[derive(Debug, Clone, PartialEq)]
pub struct ChosenSteps {
    /// Method and number of steps per sample interval.
    pub options: Options,
    /// Root mean square change of the outputs when the number of steps is doubled.
    ///
    /// In units of the scales of the outputs.
    pub change: f64,
}

/// The difference between the outputs of two simulations, in units of their scales.
///
/// NaN if an output is NaN.
#[derive(Clone, Copy)]
pub(crate) struct OutputChange {
    pub(crate) root_mean_square: f64,
    largest: f64,
}

impl OutputChange {
    /// The difference to a simulation that failed.
    pub(crate) const INFINITE: Self = Self { root_mean_square: f64::INFINITY, largest: f64::INFINITY };

    /// Compares two lists of outputs, with the scales of the outputs.
    pub(crate) fn compare(a: &[f64], b: &[f64], scales: &[f64]) -> Self {
        let differences =
            a.iter().zip(b).zip(scales.iter().cycle()).map(|((a, b), scale)| (a - b).abs() / scale);
        let keep_worse = |worst: f64, x: f64| if x > worst || x.is_nan() { x } else { worst };
        let (squares, largest) =
            differences.fold((0.0, 0.0), |(sum, most), x| (sum + x * x, keep_worse(most, x)));
        Self { root_mean_square: (squares / a.len().max(1) as f64).sqrt(), largest }
    }

    /// Whether the difference is small enough to treat both as the same simulation.
    pub(crate) fn is_accepted(self) -> bool {
        self.root_mean_square <= MAX_RMS_CHANGE && self.largest <= MAX_SINGLE_CHANGE
    }
}

impl System {
    /// Chooses the smallest number of steps per sample interval (1, 2, 4, … 64) that is accurate enough.
    ///
    /// Doubling it must change the outputs by less than a hundredth of their scales (root mean square), and
    /// no value by more than a tenth. A number that the file declares is kept. `scales` has one positive
    /// value per output, such as the standard deviation of its sensor.
    ///
    /// # Errors
    /// [`SimulationError::Stiff`] if 64 steps are too few because a rate is too fast for them; otherwise the
    /// error of the simulation with 64 steps.
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
        let change = |a: &[f64], b: &[f64]| OutputChange::compare(a, b, scales);
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
            let change = match (&coarse, &fine) {
                (Ok(coarse), Ok(fine)) => change(coarse, fine),
                _ => OutputChange::INFINITE,
            };
            let chosen =
                ChosenSteps { options: Options { method, substeps }, change: change.root_mean_square };
            if change.is_accepted() {
                return Ok(chosen);
            }
            if substeps >= MAX_SUBSTEPS {
                if method == Method::RungeKutta {
                    self.refuse_stiff(windows)?;
                }
                coarse?;
                return Ok(chosen);
            }
            (coarse, substeps) = (fine, 2 * substeps);
        }
    }

    /// The integration method that the file declares.
    pub fn declared_method(&self) -> Method {
        match self.model.numerics.integrator {
            Integrator::Explicit => Method::RungeKutta,
            Integrator::Implicit => Method::Implicit,
        }
    }

    /// Sets the widths of smoothed discontinuities that the file leaves open.
    ///
    /// Each becomes 1 % of the root mean square of its argument in a simulation of `windows`; one whose
    /// argument stays 0 keeps its width.
    ///
    /// # Errors
    /// The first error of the simulation.
    pub fn fit_widths(&mut self, windows: &[Window<'_>], options: &Options) -> Result<(), SimulationError> {
        // A width changes the simulation it was derived from; the second round settles it to a few percent.
        for _ in 0..2 {
            let sizes = discontinuity_sizes(self, windows, options)?;
            for ((width, declared), size) in self.widths.iter_mut().zip(&self.declared_widths).zip(sizes) {
                if !declared && size > 0.0 && size.is_finite() {
                    *width = WIDTH_RATIO * size;
                }
            }
        }
        Ok(())
    }

    /// Refuses a system whose fastest rate needs more than 64 explicit steps per sample interval.
    ///
    /// The rates at the windows' starts are checked.
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
            let mut step_inputs = StepInputs::<1>::new(self.model.inputs.len());
            step_inputs.begin[0] = times[0];
            for (c, signal) in step_inputs.coefficients.iter_mut().zip(&window.record.inputs) {
                c[0][0] = signal.at(times[0]);
            }
            let (_, jacobian) = linearise(&mut block, self, &step_inputs, times[0], &vec![false; n]);
            let (rate, state) = fastest_mode(&jacobian, n);
            if rate * interval > STABILITY_LIMIT * MAX_SUBSTEPS as f64 {
                let state = self.model.states[state].name.clone();
                return Err(SimulationError::Stiff { state, rate, ratio: rate * interval });
            }
        }
        Ok(())
    }
}

/// Spectral radius of a matrix, and the row that its dominant mode moves most.
///
/// By Gelfand's formula, the norm of the 64th power to the power 1/64: within some percent, also for complex
/// eigenvalues.
pub(crate) fn fastest_mode(jacobian: &[f64], n: usize) -> (f64, usize) {
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
