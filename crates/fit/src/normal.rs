//! Robust cost and normal equations of all multiple-shooting windows.
//!
//! With residuals r = measured - predicted, a scale s for each channel and u = r / s, the cost is Huber's
//! (Annals of Mathematical Statistics 35, 1964), without his factor 1/2:
//!
//! ```text
//! (1)  C = Σ ρ(u),    ρ(u) = u²            for |u| <= k
//!                            k (2 |u| - k)  for |u| > k
//! ```
//!
//! A Gauss-Newton step is a weighted least-squares problem with w = min(1, k / |u|). Window i with its
//! initial state x_i, the parameters p, and the derivatives J_p and J_x of the outputs contributes
//!
//! ```text
//! (2)  | A_i   B_i |  | δp   |   | g_i |
//!      | B_iᵀ  C_i |  | δx_i | = | h_i |
//!
//! (3)  A_i = Σ w/s² J_pᵀ J_p,   B_i = Σ w/s² J_pᵀ J_x,   C_i = Σ w/s² J_xᵀ J_x
//!      g_i = Σ w/s² J_pᵀ r,     h_i = Σ w/s² J_xᵀ r
//! ```
//!
//! A normal prior of an initial state adds one more squared residual, ((mean - x) / sd)², to the first
//! window. The mean may depend on the parameters and on the other initial states.

use crate::windows::{Problem, ShootingWindow};
use augsim_system::{Offsets, Seed, Simulated, SimulationError, Task};
use rayon::prelude::*;

/// Scaled residual k (1) above which Huber's cost grows linearly instead of quadratically.
const HUBER_THRESHOLD: f64 = 4.0;

/// Ratio of the standard deviation of a normal distribution to its median absolute deviation.
const SD_PER_MEDIAN: f64 = 1.482_602_218_505_602;

/// Contribution of one window to the cost (1) and to the normal equations (2); matrices are stored by rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct WindowEquations {
    /// Curvature in the parameters, A_i in (2), `[parameter][parameter]`; only the lower triangle is filled.
    pub a: Vec<f64>,
    /// Mixed curvature of parameters and initial state, B_i in (2), `[parameter][state]`.
    pub b: Vec<f64>,
    /// Curvature in the initial state, C_i in (2), `[state][state]`; only the lower triangle is filled.
    pub c: Vec<f64>,
    /// Right-hand side for the parameters, g_i in (2).
    pub g: Vec<f64>,
    /// Right-hand side for the initial state, h_i in (2).
    pub h: Vec<f64>,
    pub cost: f64,
    /// Sum of squared residuals, in the squared unit, and number of residuals, by channel.
    pub squared_residuals: Vec<(f64, usize)>,
    /// Absolute residuals of each channel, in its unit.
    pub absolute_residuals: Vec<Vec<f64>>,
    /// Lag-one sums over pairs of successive scaled residuals: sum of their products, sum of the later one's
    /// squares.
    pub lag_one_sums: (f64, f64),
}

/// Normal equations of all windows, in the order of the windows, with the total cost.
#[derive(Clone, Debug)]
pub(crate) struct NormalEquations {
    pub windows: Vec<WindowEquations>,
    pub cost: f64,
}

impl NormalEquations {
    /// RMSE of each channel, in its unit.
    pub fn rmse(&self, channels: usize) -> Vec<f64> {
        let channel_rms = |channel: usize| {
            let sums = self.windows.iter().filter_map(|w| w.squared_residuals.get(channel));
            let (sum, count) = sums.fold((0.0, 0), |(s, n), (square, k)| (s + square, n + k));
            (sum / f64::from(u32::try_from(count).unwrap_or(u32::MAX)).max(1.0)).sqrt()
        };
        (0..channels).map(channel_rms).collect()
    }

    /// Robust scale of the residuals of each channel, in its unit: 1.48 times the median absolute residual.
    ///
    /// Outliers do not affect the median. The scale is at least a quarter of the RMSE, because the median is
    /// almost zero where a system is at rest most of the time.
    pub fn scales(&self, channels: usize) -> Vec<f64> {
        let rms = self.rmse(channels);
        let scale = |(channel, rms): (usize, f64)| {
            let mut residuals: Vec<f64> = self
                .windows
                .iter()
                .filter_map(|w| w.absolute_residuals.get(channel))
                .flatten()
                .copied()
                .collect();
            let middle = residuals.len() / 2;
            if residuals.is_empty() {
                return rms;
            }
            let (_, median, _) = residuals.select_nth_unstable_by(middle, f64::total_cmp);
            (SD_PER_MEDIAN * *median).max(0.25 * rms)
        };
        rms.into_iter().enumerate().map(scale).collect()
    }

    /// Number of measured values in all windows.
    pub fn count(&self) -> usize {
        self.windows.iter().flat_map(|w| &w.squared_residuals).map(|(_, count)| count).sum()
    }

    /// Lag-one autocorrelation of the scaled residuals, at least 0.
    pub fn autocorrelation(&self) -> f64 {
        let sums =
            self.windows.iter().fold((0.0, 0.0), |(a, b), w| (a + w.lag_one_sums.0, b + w.lag_one_sums.1));
        if sums.1 > 0.0 { (sums.0 / sums.1).clamp(0.0, 0.9999) } else { 0.0 }
    }
}

/// Parameter values, windows and residual scales at which the cost and its normal equations are evaluated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EvaluationPoint<'a> {
    /// Values of all parameters, estimated and frozen.
    pub values: &'a [f64],
    pub windows: &'a [ShootingWindow],
    /// Scale by which the residuals of each channel are divided, in the channel's unit.
    pub scales: &'a [f64],
}

impl Problem<'_> {
    /// Evaluates the cost and its normal equations at several points.
    ///
    /// The windows of all points are simulated in common batches, because those of one point may be too few
    /// to fill the SIMD lanes.
    ///
    /// # Errors
    /// For each point, the first of its windows that cannot be simulated.
    pub fn normal_equations(
        &self,
        points: &[EvaluationPoint<'_>],
    ) -> Vec<Result<NormalEquations, SimulationError>> {
        let parameters = self.free_parameters.iter().map(|p| Seed::Parameter(*p));
        let seeds: Vec<Seed> = parameters.chain(self.free_states.iter().map(|s| Seed::Start(*s))).collect();
        let all_windows: Vec<(&EvaluationPoint<'_>, &ShootingWindow)> =
            points.iter().flat_map(|point| point.windows.iter().map(move |window| (point, window))).collect();
        let run = |batch: &[(&EvaluationPoint<'_>, &ShootingWindow)]| -> Vec<Result<WindowEquations, SimulationError>> {
            let tasks: Vec<Task<'_>> = batch
                .iter()
                .map(|(point, window)| Task {
                    parameters: point.values,
                    record: &self.records[window.record],
                    window: window.samples.clone(),
                    start: &window.initial_state,
                    offsets: Offsets::None,
                    seeds: &seeds,
                })
                .collect();
            let mut simulated = vec![Simulated::default(); tasks.len()];
            let results = self.system.simulate_batch(&tasks, &mut simulated).into_iter();
            results
                .zip(batch)
                .zip(&simulated)
                .map(|((result, (point, window)), simulated)| {
                    result.map(|()| self.window_equations(point, window, simulated))
                })
                .collect()
        };
        // A few long windows are spread over the threads even where they would fit into one batch.
        let per_thread = all_windows.len().div_ceil(rayon::current_num_threads());
        let batch_size = self.system.simd_batch_size().min(per_thread).max(1);
        let results: Vec<Result<WindowEquations, SimulationError>> =
            all_windows.par_chunks(batch_size).flat_map_iter(run).collect();
        let mut results = results.into_iter();
        let collect_point = |point: &EvaluationPoint<'_>| {
            // All results of the point are taken before the first error is returned, so that those of the
            // next point follow.
            let of_point: Vec<_> = results.by_ref().take(point.windows.len()).collect();
            let windows: Vec<WindowEquations> = of_point.into_iter().collect::<Result<_, _>>()?;
            // The sum is in the order of the windows, so that the result does not depend on the threads.
            let cost = windows.iter().map(|w| w.cost).sum();
            Ok(NormalEquations { windows, cost })
        };
        points.iter().map(collect_point).collect()
    }

    /// Computes the contribution of one simulated window to the cost (1) and the normal equations (2).
    fn window_equations(
        &self,
        point: &EvaluationPoint<'_>,
        window: &ShootingWindow,
        simulated: &Simulated,
    ) -> WindowEquations {
        let scales = point.scales;
        let (p, n) = (self.free_parameters.len(), self.free_states.len());
        let channels = self.schema().channels.len();
        let mut equations = WindowEquations {
            a: vec![0.0; p * p],
            b: vec![0.0; p * n],
            c: vec![0.0; n * n],
            g: vec![0.0; p],
            h: vec![0.0; n],
            squared_residuals: vec![(0.0, 0); channels],
            absolute_residuals: vec![Vec::new(); channels],
            ..WindowEquations::default()
        };
        let record = &self.records[window.record];
        for (channel, declared) in self.schema().channels.iter().enumerate() {
            let scale = scales[channel];
            let mut previous = None;
            for k in 0..simulated.samples() {
                let measured = record.values[channel][window.samples.start + k];
                if !measured.is_finite() {
                    previous = None;
                    continue;
                }
                let mut residual = measured - simulated.value(k, channel);
                if let Some(period) = declared.period {
                    // A periodic channel, such as an angle: the residual is the shortest way around.
                    residual -= period * (residual / period).round();
                }
                let scaled = residual / scale;
                let is_outlier = scaled.abs() > HUBER_THRESHOLD;
                let weight = if is_outlier { HUBER_THRESHOLD / scaled.abs() } else { 1.0 };
                equations.cost += if is_outlier {
                    HUBER_THRESHOLD * (2.0 * scaled.abs() - HUBER_THRESHOLD)
                } else {
                    scaled * scaled
                };
                equations.squared_residuals[channel].0 += residual * residual;
                equations.squared_residuals[channel].1 += 1;
                equations.absolute_residuals[channel].push(residual.abs());
                if let Some(previous) = previous {
                    equations.lag_one_sums.0 += scaled * previous;
                    equations.lag_one_sums.1 += scaled * scaled;
                }
                previous = Some(scaled);
                if p + n > 0 {
                    let row = &simulated.slopes(k, channel)[..p + n];
                    equations.add_row(row, (p, n), weight / scale, scaled / scale * weight, scale);
                }
            }
        }
        for state in &self.free_states {
            if let Some(prior) = self.prior(point.values, window, *state) {
                let scaled = prior.deviation / prior.sd;
                equations.cost += scaled * scaled;
                equations.add_row(&prior.row, (p, n), 1.0 / prior.sd, scaled / prior.sd, prior.sd);
            }
        }
        equations
    }
}

impl WindowEquations {
    /// Adds one residual to the sums of the normal equations (3). `row` holds its derivatives J_p and J_x,
    /// `weight` is w / s, `pull` is w r / s².
    fn add_row(&mut self, row: &[f64], (p, n): (usize, usize), weight: f64, pull: f64, scale: f64) {
        let (by_parameters, by_state) = row.split_at(p);
        for (i, x) in by_parameters.iter().enumerate() {
            let scaled = weight / scale * x;
            self.g[i] += pull * x;
            for (to, y) in self.a[i * p..=i * p + i].iter_mut().zip(by_parameters) {
                *to += scaled * y;
            }
            for (to, y) in self.b[i * n..(i + 1) * n].iter_mut().zip(by_state) {
                *to += scaled * y;
            }
        }
        for (i, x) in by_state.iter().enumerate() {
            let scaled = weight / scale * x;
            self.h[i] += pull * x;
            for (to, y) in self.c[i * n..=i * n + i].iter_mut().zip(by_state) {
                *to += scaled * y;
            }
        }
    }
}
