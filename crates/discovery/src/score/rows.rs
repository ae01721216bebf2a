//! Residuals and their sensitivities at a fit, sample by sample, with the nuisances of each window projected
//! out.
//!
//! In a window, `r` are the residuals in units of the noise, `J` their sensitivities to theta, `N` those to
//! the window's nuisances (initial state, offsets), and `P` the prior precisions of the nuisances. The
//! nuisances follow every change of theta (variable projection, Golub and Pereyra 1973): with `X = (w N'N +
//! P)^-1 w N'J` the rows become `J - N X`, and each prior adds the row `-P^1/2 X`.

use super::blocks::Blocks;
use crate::evaluate::{Lanes, Point, cost_and_weight, nuisance_priors, simulate_windows, whitened_rows};
use crate::fit::Fit;
use crate::linear::{Cholesky, Square};
use crate::record::ChosenRecords;
use crate::record::RecordWindow;
use augsim_system::{Seed, System};
use std::ops::Range;

/// Residuals and sensitivities of one window, with its nuisances (initial state, record parameters, event
/// offsets) projected out.
#[derive(Clone, Debug)]
pub(crate) struct WindowRows {
    /// Robust weight of the window in the fit.
    pub weight: f64,
    /// Degrees of freedom of the window's residuals.
    pub degrees_of_freedom: f64,
    /// Whether the noise is a tolerance: residuals below it are not rewarded beyond the Gaussian cost.
    pub is_tolerance: bool,
    /// Sensitivities of each row, then its residual, [`Rows::width`] numbers a row. Rows of priors come last.
    pub values: Vec<f64>,
    /// Block and channel of each row.
    pub block_and_channel: Vec<(u16, u16)>,
    /// Number of rows that represent priors of nuisances (initial state, record parameters, event offsets).
    pub priors: usize,
    /// Part of the window's cost that its rows do not contain: log determinants of its event offsets, and of the
    /// initial values of effects' states.
    pub constant: f64,
    projection: Projection,
    /// Residuals of the measured samples before the nuisances (initial state, record parameters, event
    /// offsets) are projected out.
    plain: Vec<f64>,
}

/// Projection of a window's nuisances (initial state, record parameters, event offsets) out of further
/// columns.
#[derive(Clone, Debug)]
struct Projection {
    count: usize,
    /// Sensitivities of the residuals to the nuisances (initial state, record parameters, event offsets),
    /// `count` numbers a row.
    rows: Vec<f64>,
    precision: Vec<f64>,
    curvature: Square,
    factor: Cholesky,
}

impl Projection {
    fn new(rows: Vec<f64>, precision: Vec<f64>, weight: f64) -> Self {
        let count = precision.len();
        let mut curvature = Square::zero(count);
        for row in rows.chunks_exact(count.max(1)) {
            for i in 0..count {
                (0..count).for_each(|j| *curvature.at_mut(i, j) += weight * row[i] * row[j]);
            }
        }
        (0..count).for_each(|i| *curvature.at_mut(i, i) += precision[i]);
        let factor = curvature.cholesky();
        Self { count, rows, precision, curvature, factor }
    }

    /// Part of minus twice the log marginal likelihood of a window that its estimated nuisances `range` cost:
    /// the log of the ratio of prior to posterior volume, with the nuisances before them free.
    ///
    /// It is 0 for nuisances that the data do not determine, such as the state of an effect of no strength.
    fn log_volume_of_priors(&self, range: Range<usize>) -> f64 {
        if range.is_empty() {
            return 0.0;
        }
        let log_det = |end: usize| self.curvature.sub(&(0..end).collect::<Vec<_>>()).cholesky().log_det;
        log_det(range.end) - log_det(range.start) - range.map(|i| self.precision[i].ln()).sum::<f64>()
    }

    /// Projects the nuisances (initial state, record parameters, event offsets) out of columns, `width`
    /// numbers a row. Returns the rows of the priors.
    fn apply(&self, columns: &mut [f64], width: usize, weight: f64) -> Vec<f64> {
        let n = self.count;
        if n == 0 || width == 0 {
            return Vec::new();
        }
        let mut steps = vec![vec![0.0; n]; width];
        for (sensitivities, row) in self.rows.chunks_exact(n).zip(columns.chunks_exact(width)) {
            for (step, value) in steps.iter_mut().zip(row).filter(|(_, value)| **value != 0.0) {
                step.iter_mut().zip(sensitivities).for_each(|(s, o)| *s += weight * o * value);
            }
        }
        steps.iter_mut().for_each(|step| self.factor.solve(step));
        for (sensitivities, row) in self.rows.chunks_exact(n).zip(columns.chunks_exact_mut(width)) {
            for (value, step) in row.iter_mut().zip(&steps) {
                *value -= sensitivities.iter().zip(step).map(|(o, s)| o * s).sum::<f64>();
            }
        }
        let known = (0..n).filter(|i| self.precision[*i] > 0.0);
        known.flat_map(|i| steps.iter().map(move |s| -self.precision[i].sqrt() * s[i])).collect()
    }

    /// Residuals, then those of the priors, after the Gauss-Newton step of the nuisances (initial state,
    /// record parameters, event offsets) to their minimum. At a minimum, where the gradients of residuals and
    /// priors cancel, the step is 0.
    fn residuals_after_nuisance_step(
        &self,
        residuals: &[f64],
        priors: &[(f64, f64)],
        weight: f64,
    ) -> Vec<f64> {
        let n = self.count;
        let mut step = vec![0.0; n];
        for (sensitivities, r) in self.rows.chunks_exact(n.max(1)).zip(residuals) {
            step.iter_mut().zip(sensitivities).for_each(|(s, o)| *s += weight * o * r);
        }
        step.iter_mut().zip(priors).for_each(|(s, (offset, precision))| *s -= precision * offset);
        self.factor.solve(&mut step);
        let mut out: Vec<f64> = residuals.to_vec();
        for (r, sensitivities) in out.iter_mut().zip(self.rows.chunks_exact(n.max(1))) {
            *r -= sensitivities.iter().zip(&step).map(|(o, s)| o * s).sum::<f64>();
        }
        let known = priors.iter().zip(&step).filter(|((_, precision), _)| *precision > 0.0);
        out.extend(known.map(|((offset, precision), s)| -precision.sqrt() * (offset + s)));
        out
    }
}

/// Rows (sensitivities and residuals) of all windows of a sample at a fit.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    /// Number of columns; the last one is the residual.
    pub width: usize,
    pub windows: Vec<WindowRows>,
}

/// The windows of a fit, each with its record and the order of its derivatives.
pub(crate) struct FitWindows<'a> {
    pub sample: &'a ChosenRecords<'a>,
    pub fit: &'a Fit,
    pub windows: Vec<RecordWindow<'a>>,
    /// For each window, the position of its record in the list of chosen records.
    pub chosen: Vec<usize>,
    pub lanes: Vec<Lanes>,
}

impl<'a> FitWindows<'a> {
    pub fn new(sample: &'a ChosenRecords<'a>, fit: &'a Fit) -> Self {
        let windows = sample.windows();
        let lanes = windows.iter().map(|&at| Lanes::new(&fit.hypothesis, at, &[])).collect();
        let records = sample.windows_by_record().into_iter().enumerate();
        let chosen = records.flat_map(|(r, range)| range.map(move |_| r)).collect();
        Self { sample, fit, windows, chosen, lanes }
    }

    /// Every `step`-th window; `fit` contains the nuisances (initial state, record parameters, event offsets) of these alone.
    pub fn at_every<'b>(&self, step: usize, fit: &'b Fit) -> FitWindows<'b>
    where
        'a: 'b,
    {
        FitWindows {
            sample: self.sample,
            fit,
            windows: self.windows.iter().step_by(step).copied().collect(),
            chosen: self.chosen.iter().step_by(step).copied().collect(),
            lanes: self.lanes.iter().step_by(step).cloned().collect(),
        }
    }

    /// Simulation points of the windows in `system`. Its parameters from index `first` on have the values
    /// `further`.
    fn points<'s>(&'s self, system: &'s dyn System, first: usize, further: &[f64]) -> Vec<Point<'s>> {
        let (h, theta) = (&self.fit.hypothesis, &self.fit.theta);
        let each = self.windows.iter().zip(&self.lanes).zip(&self.fit.nuisance);
        each.map(|((at, lanes), own)| {
            self.sample.data.work.count_simulation();
            Point::new(h, system, lanes, at.record, theta, own).with_values(first, further)
        })
        .collect()
    }

    /// Computes the rows of each window: sensitivities to theta (the shared parameters), and the residual.
    pub fn rows(&self, blocks: &Blocks) -> Rows {
        let h = &self.fit.hypothesis;
        let points = self.points(&*h.system, h.system.parameters().len(), &[]);
        let width = h.theta_len() + 1;
        let seeds: Vec<&[Seed]> = self.lanes.iter().map(|lanes| &lanes.seeds[..]).collect();
        let windows = simulate_windows(&points, &self.lanes, &self.windows, &seeds, |w, run| {
            let (values, places) = whitened_rows(run, self.windows[w], self.sample.correlation);
            let block = |k: usize| blocks.block(self.chosen[w], k);
            let places: Vec<(u16, u16)> = places.iter().map(|&(c, k)| (block(k), c as u16)).collect();
            self.window(w, &points[w], &values, places, width)
        });
        Rows { width, windows }
    }

    /// Projects the nuisances (initial state, record parameters, event offsets) out of one window's rows;
    /// `values` are its rows with all derivatives.
    fn window(
        &self,
        w: usize,
        point: &Point<'_>,
        values: &[f64],
        mut places: Vec<(u16, u16)>,
        width: usize,
    ) -> WindowRows {
        let (lanes, window) = (&self.lanes[w], self.windows[w]);
        let (common, nuisances) = (lanes.common(), lanes.nuisances());
        let mut columns = vec![0.0; places.len() * width];
        let (mut sensitivities, mut plain) = (Vec::new(), Vec::new());
        let mut residual_norm_squared = 0.0;
        let each = values.chunks_exact(common + nuisances + 1).zip(columns.chunks_exact_mut(width));
        for (row, to) in each {
            lanes.theta.iter().zip(row).for_each(|(&t, value)| to[t] = *value);
            to[width - 1] = row[common + nuisances];
            sensitivities.extend_from_slice(&row[common..common + nuisances]);
            plain.push(row[common + nuisances]);
            residual_norm_squared += row[common + nuisances].powi(2);
        }
        let freedom = (places.len() as f64 - lanes.unpenalised_nuisances() as f64).max(1.0);
        let is_tolerance = window.record.is_tolerance;
        let weight = cost_and_weight(residual_norm_squared, freedom, is_tolerance).1;
        let priors = nuisance_priors(point, lanes, window);
        let precision = priors.iter().map(|p| p.1).collect();
        let projection = Projection::new(sensitivities, precision, weight);
        let mut prior_rows = projection.apply(&mut columns, width, weight);
        let after_step = projection.residuals_after_nuisance_step(&plain, &priors, weight);
        for (row, r) in columns.chunks_exact_mut(width).zip(&after_step) {
            row[width - 1] = *r;
        }
        for (row, r) in prior_rows.chunks_exact_mut(width.max(1)).zip(&after_step[plain.len()..]) {
            row[width - 1] = *r;
        }
        let first = places.first().map_or(0, |p| p.0);
        let count = prior_rows.len() / width.max(1);
        places.extend(std::iter::repeat_n((first, u16::MAX), count));
        columns.extend(prior_rows);
        let scatter = self.fit.hypothesis.scatter.filter(|_| lanes.offsets > 0);
        let constant = projection
            .log_volume_of_priors(lanes.starts() - lanes.effect_starts()..lanes.starts())
            + scatter.map_or(0.0, |s| projection.factor.log_det + 2.0 * lanes.offsets as f64 * s.sd.ln());
        WindowRows {
            weight,
            degrees_of_freedom: freedom,
            is_tolerance,
            values: columns,
            block_and_channel: places,
            priors: count,
            constant,
            projection,
            plain,
        }
    }

    /// Sensitivities of each window's residuals to the parameters of `system` from index `first` on, as
    /// projected columns. They are computed at the values `further`; rows of priors come last.
    pub fn columns(&self, rows: &Rows, system: &dyn System, first: usize, further: &[f64]) -> Vec<Vec<f64>> {
        let points = self.points(system, first, further);
        let parameters: Vec<Seed> = (first..first + further.len()).map(Seed::Parameter).collect();
        let seeds: Vec<&[Seed]> = self.windows.iter().map(|_| &parameters[..]).collect();
        let count = further.len();
        simulate_windows(&points, &self.lanes, &self.windows, &seeds, |w, run| {
            let (values, _) = whitened_rows(run, self.windows[w], self.sample.correlation);
            let mut columns: Vec<f64> =
                values.chunks_exact(count + 1).flat_map(|row| &row[..count]).copied().collect();
            let window = &rows.windows[w];
            let prior_rows = window.projection.apply(&mut columns, count, window.weight);
            columns.extend(prior_rows);
            columns
        })
    }

    /// Change of each window's prediction from the fit to `system` with the parameter values `further`, as
    /// one projected column. Not finite where the system cannot be simulated.
    pub fn change(&self, rows: &Rows, system: &dyn System, first: usize, further: &[f64]) -> Vec<Vec<f64>> {
        let points = self.points(system, first, further);
        let seeds: Vec<&[Seed]> = self.windows.iter().map(|_| &[][..]).collect();
        simulate_windows(&points, &self.lanes, &self.windows, &seeds, |w, run| {
            let (values, _) = whitened_rows(run, self.windows[w], self.sample.correlation);
            let window = &rows.windows[w];
            let mut column: Vec<f64> = window.plain.iter().zip(&values).map(|(a, b)| a - b).collect();
            let prior_rows = window.projection.apply(&mut column, 1, window.weight);
            column.extend(prior_rows);
            column
        })
    }
}

impl WindowRows {
    /// Number of residuals (measured samples); their rows come before those of priors.
    pub fn samples(&self) -> usize {
        self.block_and_channel.len() - self.priors
    }
}

impl Rows {
    /// Number of residuals (measured samples).
    pub fn samples(&self) -> usize {
        self.windows.iter().map(WindowRows::samples).sum()
    }

    /// Whether the residuals of a channel, root mean square, exceed the noise by more than the factor `ratio`.
    pub fn exceed_noise(&self, ratio: f64) -> bool {
        let mut sums: Vec<(f64, f64)> = Vec::new();
        for window in &self.windows {
            let rows = window.values.chunks_exact(self.width).zip(&window.block_and_channel);
            for (row, (_, channel)) in rows.take(window.samples()) {
                let channel = usize::from(*channel);
                if sums.len() <= channel {
                    sums.resize(channel + 1, (0.0, 0.0));
                }
                sums[channel].0 += row[self.width - 1].powi(2);
                sums[channel].1 += 1.0;
            }
        }
        sums.iter().any(|(squares, count)| *squares > ratio * ratio * count)
    }

    /// Rows of every `step`-th window.
    pub fn at_every(&self, step: usize) -> Self {
        Self { width: self.width, windows: self.windows.iter().step_by(step).cloned().collect() }
    }
}

#[cfg(test)]
impl Rows {
    /// Rows of windows of a linear model without initial states and event offsets, given sensitivities,
    /// residual and block of each row. `weight` is that of a window, given the squared norm and the number of
    /// its residuals.
    pub fn of_linear_windows(
        windows: &[Vec<(Vec<f64>, f64, u16)>],
        weight: impl Fn(f64, f64) -> f64,
    ) -> Self {
        let width = windows.first().and_then(|rows| rows.first()).map_or(1, |r| r.0.len() + 1);
        let window = |rows: &Vec<(Vec<f64>, f64, u16)>| WindowRows {
            weight: weight(rows.iter().map(|r| r.1 * r.1).sum(), rows.len() as f64),
            degrees_of_freedom: rows.len() as f64,
            is_tolerance: false,
            values: rows.iter().flat_map(|(x, r, _)| x.iter().copied().chain([*r])).collect(),
            block_and_channel: rows.iter().map(|(_, _, block)| (*block, 0)).collect(),
            priors: 0,
            constant: 0.0,
            projection: Projection::new(Vec::new(), Vec::new(), 1.0),
            plain: Vec::new(),
        };
        Self { width, windows: windows.iter().map(window).collect() }
    }
}
