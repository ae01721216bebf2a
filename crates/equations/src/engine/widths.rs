//! Chooses the widths of smoothed discontinuities before a fit.
//!
//! A jump `sign(z)` is simulated as `tanh(z / width)`. A body that dry friction holds then creeps, at a speed of the order of the
//! width. How far it gets depends on how long it is held, so that no share of its usual speed is narrow enough for all data.

use super::simulate::discontinuity_sizes;
use super::stability::{STABILITY_LIMIT, fastest_mode, longest_interval_s};
use super::substeps::OutputChange;
use super::{Method, Options, SimulationError, Window};
use crate::limits::MAX_SUBSTEPS;
use crate::system::System;

/// Width of a smoothed discontinuity as a share of the root mean square of its argument, from which it is halved.
const WIDTH_RATIO: f64 = 0.01;
/// Maximum accepted root mean square change of the outputs when the widths are halved, in units of their scales.
///
/// The error is about twice as large: a bias of a tenth of the noise, whose autocorrelation of 0.01 is below three standard
/// errors of that of 90,000 samples.
const MAX_CHANGE: f64 = 0.05;
/// Maximum number of times that the widths are halved.
const MAX_HALVINGS: usize = 4;
/// Number by which the fastest rate may grow in a fit before explicit steps are unstable: the parameters that a fit finds may be
/// larger than the declared ones.
const STABILITY_RESERVE: f64 = 2.0;

impl System {
    /// Chooses the widths of smoothed discontinuities for which the file declares none.
    ///
    /// Each becomes 1 % of the root mean square of its argument in a simulation of `windows`; a width whose
    /// argument stays 0 is not changed. [`narrow_widths`](Self::narrow_widths) halves them where that is too wide.
    ///
    /// # Errors
    /// The first error of the simulation.
    pub fn fit_widths(&mut self, windows: &[Window<'_>], options: &Options) -> Result<(), SimulationError> {
        if self.declared_widths.iter().all(|is_declared| *is_declared) {
            return Ok(());
        }
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

    /// Halves the widths that the file does not declare as long as that changes the outputs by more than a twentieth of their
    /// `scales`, and returns the number of steps for the result.
    ///
    /// `chosen` are the method, which stays, and the number of steps for the present widths. Widths for which explicit steps
    /// would not be stable are not taken.
    pub fn narrow_widths(&mut self, windows: &[Window<'_>], scales: &[f64], chosen: Options) -> Options {
        let mut options = chosen;
        if self.declared_widths.iter().all(|is_declared| *is_declared) {
            return options;
        }
        let Ok(mut wide) = self.all_outputs(windows, &options) else { return options };
        for _ in 0..MAX_HALVINGS {
            let mut narrower = self.clone();
            narrower.scale_undeclared_widths(0.5);
            let Ok(steps) = narrower.choose_substeps(windows, scales, options.method) else { return options };
            let Ok(narrow) = narrower.all_outputs(windows, &steps.options) else { return options };
            let is_needed = OutputChange::compare(&wide, &narrow, scales).root_mean_square > MAX_CHANGE;
            let Some(stable) = narrower.stable_steps(windows, steps.options).filter(|_| is_needed) else {
                return options;
            };
            (*self, options, wide) = (narrower, stable, narrow);
        }
        options
    }

    /// Multiplies the widths that the file does not declare by `factor`.
    fn scale_undeclared_widths(&mut self, factor: f64) {
        let widths = self.widths.iter_mut().zip(&self.declared_widths);
        widths.filter(|(_, is_declared)| !**is_declared).for_each(|(width, _)| *width *= factor);
    }

    /// The method and number of steps of `options`, with at least as many explicit steps as are stable within the widths;
    /// `None` if that are too many.
    fn stable_steps(&self, windows: &[Window<'_>], options: Options) -> Option<Options> {
        if options.method != Method::RungeKutta {
            return Some(options);
        }
        let needed = self.fastest_rate_times_interval(windows) * STABILITY_RESERVE / STABILITY_LIMIT;
        // Rounding must not add a step.
        let needed = (needed - 1e-6).ceil().max(options.substeps as f64);
        (needed <= MAX_SUBSTEPS as f64).then_some(Options { substeps: needed as usize, ..options })
    }

    /// Largest product, over windows, of the rate of the fastest mode where the arguments of all smoothed jumps are 0, and the
    /// longest sample interval. The other values are those at the start of the window.
    ///
    /// There `tanh(z / width)` is `z / width`. With widths that are `WIDE` times as large it is so everywhere, and its derivative
    /// is `1 / WIDE` of that; with still larger ones the jumps have no derivative.
    fn fastest_rate_times_interval(&self, windows: &[Window<'_>]) -> f64 {
        const WIDE: f64 = 1e6;
        let [with_wide, without] = [WIDE, WIDE * WIDE].map(|factor| {
            let mut system = self.clone();
            system.scale_undeclared_widths(factor);
            system
        });
        let product = |window: &Window<'_>| {
            let (wide, none) = (with_wide.jacobian_at_start(window), without.jacobian_at_start(window));
            let jacobian: Vec<f64> =
                none.iter().zip(&wide).map(|(none, wide)| none + WIDE * (wide - none)).collect();
            fastest_mode(&jacobian, self.states()).0 * longest_interval_s(window)
        };
        windows.iter().map(product).fold(0.0, f64::max)
    }
}
