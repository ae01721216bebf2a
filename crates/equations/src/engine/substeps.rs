//! Chooses the number of integration steps before a fit.

use super::{Method, Options, SimulationError, Window};
use crate::limits::MAX_SUBSTEPS;
use crate::model::Integrator;
use crate::system::System;

/// Maximum accepted root mean square change of the outputs when the number of steps is doubled.
///
/// In units of the scales of the outputs, such as the standard deviation of the sensor.
const MAX_RMS_CHANGE: f64 = 0.01;
/// Maximum accepted change of a single output value when steps are doubled, in units of its scale.
const MAX_SINGLE_CHANGE: f64 = 0.1;
/// Number of steps per sample interval for trials of a method and for choosing smoothing widths.
pub(crate) const TRIAL_SUBSTEPS: usize = 8;

/// Chosen integration steps, and how much the outputs change with finer ones.
#[derive(Debug, Clone, PartialEq)]
pub struct ChosenSteps {
    /// Chosen method and number of steps per sample interval.
    pub options: Options,
    /// Root mean square change of the outputs when the chosen number of steps is doubled.
    ///
    /// In units of the scales of the outputs, such as the standard deviation of the sensor.
    pub change: f64,
}

/// Difference between the outputs of two simulations, in units of the scales of the outputs.
///
/// The difference is NaN if an output is NaN.
#[derive(Clone, Copy)]
pub(crate) struct OutputChange {
    pub(crate) root_mean_square: f64,
    largest: f64,
}

impl OutputChange {
    /// The difference that stands for a simulation that failed.
    pub(crate) const INFINITE: Self = Self { root_mean_square: f64::INFINITY, largest: f64::INFINITY };

    /// Compares two lists of outputs, in units of the `scales` of the outputs.
    pub(crate) fn compare(a: &[f64], b: &[f64], scales: &[f64]) -> Self {
        let differences =
            a.iter().zip(b).zip(scales.iter().cycle()).map(|((a, b), scale)| (a - b).abs() / scale);
        let keep_worse = |worst: f64, x: f64| if x > worst || x.is_nan() { x } else { worst };
        let (squares, largest) =
            differences.fold((0.0, 0.0), |(sum, most), x| (sum + x * x, keep_worse(most, x)));
        Self { root_mean_square: (squares / a.len().max(1) as f64).sqrt(), largest }
    }

    /// Whether the difference is small enough to treat both simulations as the same.
    pub(crate) fn is_accepted(self) -> bool {
        self.root_mean_square <= MAX_RMS_CHANGE && self.largest <= MAX_SINGLE_CHANGE
    }
}

impl System {
    /// Chooses the method and the smallest number of steps per sample interval (1, 2, 4, … 64) that is accurate.
    ///
    /// Doubling it must change the outputs by less than a hundredth of their scales (root mean square), and
    /// no value by more than a tenth. A number that the file declares is kept. A file that declares no method
    /// gets explicit steps, or implicit ones if the system is stiff. `scales` has one positive value per
    /// output, such as the standard deviation of its sensor.
    ///
    /// # Errors
    /// [`SimulationError::Stiff`] if the file declares explicit steps and a rate is too fast for 64 of them;
    /// otherwise the error of the simulation.
    pub fn choose_steps(
        &self,
        windows: &[Window<'_>],
        scales: &[f64],
    ) -> Result<ChosenSteps, SimulationError> {
        self.choose_substeps(windows, scales, self.method_for(windows))
    }

    /// Chooses the integration method: as declared in the file, else explicit steps if they can simulate all windows.
    pub fn method_for(&self, windows: &[Window<'_>]) -> Method {
        let can_simulate = |method| {
            let results = self.simulate(windows, &[], &Options { method, substeps: TRIAL_SUBSTEPS });
            results.iter().all(Result::is_ok)
        };
        let is_declared = self.model.numerics.integrator != Integrator::Automatic
            || matches!(self.declared_method(), Method::Euler { .. });
        // The rates may become too fast for explicit steps only after the start of a window. If no method can simulate, the error of the explicit
        // steps says more.
        let is_explicit = is_declared || !self.is_stiff(windows) && can_simulate(Method::RungeKutta);
        if is_explicit || !can_simulate(Method::Implicit) { self.declared_method() } else { Method::Implicit }
    }

    /// Chooses the number of steps per sample interval of a method.
    pub(super) fn choose_substeps(
        &self,
        windows: &[Window<'_>],
        scales: &[f64],
        method: Method,
    ) -> Result<ChosenSteps, SimulationError> {
        // Additional steps of windows that begin with a fast mode would hide how many steps the others need.
        let tried = if method == Method::RungeKutta { Method::UncheckedRungeKutta } else { method };
        let run = |substeps: usize| self.all_outputs(windows, &Options { method: tried, substeps });
        // The steps of an external function are those of its simulator, so that none are more accurate.
        if matches!(method, Method::Euler { .. }) {
            return run(1).map(|_| ChosenSteps { options: Options { method, substeps: 1 }, change: 0.0 });
        }
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
                let checked = self.simulate(windows, &[], &chosen.options);
                return checked.into_iter().collect::<Result<Vec<_>, _>>().map(|_| chosen);
            }
            (coarse, substeps) = (fine, 2 * substeps);
        }
    }

    /// Outputs of all windows, one after the other, or the first error of the simulation.
    pub(super) fn all_outputs(
        &self,
        windows: &[Window<'_>],
        options: &Options,
    ) -> Result<Vec<f64>, SimulationError> {
        let results = self.simulate(windows, &[], options);
        let values: Result<Vec<_>, _> = results.into_iter().map(|r| r.map(|s| s.values)).collect();
        Ok(values?.concat())
    }

    /// Integration method that the file declares; explicit steps if it declares none.
    pub fn declared_method(&self) -> Method {
        if let Some(step_s) = self.model.external.as_ref().and_then(|external| external.step_s) {
            return Method::Euler { step_s };
        }
        match self.model.numerics.integrator {
            Integrator::Automatic | Integrator::Explicit => Method::RungeKutta,
            Integrator::Implicit => Method::Implicit,
        }
    }
}
