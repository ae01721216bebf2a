//! Residuals and their sensitivities at a fit, sample by sample, with what belongs to one window alone projected out.
//!
//! In a window, `r` are the residuals in units of the noise, `J` their sensitivities to what all windows share and `N` to the window's
//! own unknowns (its start, its random offsets), whose priors have the precisions `P`. The own unknowns follow every change of the
//! others (Golub and Pereyra 1973): with `X = (w N'N + P)^-1 w N'J` the rows become `J - N X`, and each prior adds the row `-P^1/2 X`.

use super::blocks::Blocks;
use crate::chosen_records::ChosenRecords;
use crate::evaluate::{Lanes, Point, own_priors, simulated, weight, whitened_rows};
use crate::fit::Fit;
use crate::linear::{Cholesky, Square};
use crate::record::Excerpt;
use augsim_physics::system::{Seed, System};

/// Rows of one window.
#[derive(Clone, Debug)]
pub(crate) struct WindowRows {
    /// Weight of the window in the fit.
    pub weight: f64,
    /// Degrees of freedom of its misfit.
    pub freedom: f64,
    /// A misfit below the noise counts as one at it.
    pub tolerated: bool,
    /// Sensitivities of each row and last its residual, [`Rows::width`] numbers a row; rows of priors come last.
    pub values: Vec<f64>,
    /// Block and channel of every row.
    pub places: Vec<(u16, u16)>,
    /// How many of the rows are those of priors.
    pub priors: usize,
    /// Part of the window's cost beside its rows: logarithms of determinants of its offsets.
    pub constant: f64,
    own: Projection,
    /// Rows of the measured samples as they were simulated, residuals alone.
    plain: Vec<f64>,
}

/// Projection of a window's own unknowns out of further columns.
#[derive(Clone, Debug)]
struct Projection {
    count: usize,
    /// Sensitivities to the own unknowns, `count` numbers a row.
    rows: Vec<f64>,
    precision: Vec<f64>,
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
        Self { count, rows, precision, factor }
    }

    /// Takes the own unknowns out of columns, `width` numbers a row, and gives the rows of the priors.
    fn apply(&self, columns: &mut [f64], width: usize, weight: f64) -> Vec<f64> {
        let n = self.count;
        if n == 0 || width == 0 {
            return Vec::new();
        }
        let mut steps = vec![vec![0.0; n]; width];
        for (own, row) in self.rows.chunks_exact(n).zip(columns.chunks_exact(width)) {
            for (step, value) in steps.iter_mut().zip(row).filter(|(_, value)| **value != 0.0) {
                step.iter_mut().zip(own).for_each(|(s, o)| *s += weight * o * value);
            }
        }
        steps.iter_mut().for_each(|step| self.factor.solve(step));
        for (own, row) in self.rows.chunks_exact(n).zip(columns.chunks_exact_mut(width)) {
            for (value, step) in row.iter_mut().zip(&steps) {
                *value -= own.iter().zip(step).map(|(o, s)| o * s).sum::<f64>();
            }
        }
        let known = (0..n).filter(|i| self.precision[*i] > 0.0);
        known.flat_map(|i| steps.iter().map(move |s| -self.precision[i].sqrt() * s[i])).collect()
    }

    /// Residuals, and those of the priors behind them, after the own unknowns have taken the step to their least cost: where a prior holds an
    /// unknown off, the residuals pull at it as much.
    fn settled(&self, residuals: &[f64], priors: &[(f64, f64)], weight: f64) -> Vec<f64> {
        let n = self.count;
        let mut step = vec![0.0; n];
        for (own, r) in self.rows.chunks_exact(n.max(1)).zip(residuals) {
            step.iter_mut().zip(own).for_each(|(s, o)| *s += weight * o * r);
        }
        step.iter_mut().zip(priors).for_each(|(s, (offset, precision))| *s -= precision * offset);
        self.factor.solve(&mut step);
        let mut out: Vec<f64> = residuals.to_vec();
        for (r, own) in out.iter_mut().zip(self.rows.chunks_exact(n.max(1))) {
            *r -= own.iter().zip(&step).map(|(o, s)| o * s).sum::<f64>();
        }
        let known = priors.iter().zip(&step).filter(|((_, precision), _)| *precision > 0.0);
        out.extend(known.map(|((offset, precision), s)| -precision.sqrt() * (offset + s)));
        out
    }
}

/// Rows of all windows of a sample at a fit.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    /// Columns, the last of which is the residual.
    pub width: usize,
    pub windows: Vec<WindowRows>,
}

/// The places at which a fit's windows are simulated.
pub(crate) struct Places<'a> {
    pub sample: &'a ChosenRecords<'a>,
    pub fit: &'a Fit,
    pub windows: Vec<Excerpt<'a>>,
    /// Which of the chosen records each window is of.
    pub chosen: Vec<usize>,
    pub lanes: Vec<Lanes>,
}

impl<'a> Places<'a> {
    pub fn new(sample: &'a ChosenRecords<'a>, fit: &'a Fit) -> Self {
        let windows = sample.excerpts();
        let lanes = windows.iter().map(|&at| Lanes::new(&fit.hypothesis, at, &[])).collect();
        let records = sample.of_records().into_iter().enumerate();
        let chosen = records.flat_map(|(r, range)| range.map(move |_| r)).collect();
        Self { sample, fit, windows, chosen, lanes }
    }

    /// Points of the windows in `system`, whose parameters from number `first` on have the values `further`.
    fn points<'s>(&'s self, system: &'s dyn System, first: usize, further: &[f64]) -> Vec<Point<'s>> {
        let (h, theta) = (&self.fit.hypothesis, &self.fit.theta);
        let each = self.windows.iter().zip(&self.lanes).zip(&self.fit.nuisance);
        each.map(|((at, lanes), own)| {
            self.sample.data.tally.simulation();
            Point::new(h, system, lanes, at.record, theta, own).with_values(first, further)
        })
        .collect()
    }

    /// The rows of each window: sensitivities to theta, and the residual.
    pub fn rows(&self, blocks: &Blocks) -> Rows {
        let h = &self.fit.hypothesis;
        let points = self.points(&*h.system, h.system.parameters().len(), &[]);
        let width = h.theta_len() + 1;
        let seeds: Vec<&[Seed]> = self.lanes.iter().map(Lanes::seeds).collect();
        let windows = simulated(&points, &self.lanes, &self.windows, &seeds, |w, run| {
            let (values, places) = whitened_rows(run, self.windows[w], self.sample.correlation);
            let block = |k: usize| blocks.block(self.chosen[w], k);
            let places: Vec<(u16, u16)> = places.iter().map(|&(c, k)| (block(k), c as u16)).collect();
            self.window(w, &points[w], &values, places, width)
        });
        Rows { width, windows }
    }

    /// The projected rows of one window from its rows in all lanes.
    fn window(
        &self,
        w: usize,
        point: &Point<'_>,
        values: &[f64],
        mut places: Vec<(u16, u16)>,
        width: usize,
    ) -> WindowRows {
        let (lanes, at) = (&self.lanes[w], self.windows[w]);
        let (common, own) = (lanes.common(), lanes.nuisances());
        let mut columns = vec![0.0; places.len() * width];
        let (mut sensitivities, mut plain) = (Vec::new(), Vec::new());
        let mut misfit = 0.0;
        let each = values.chunks_exact(common + own + 1).zip(columns.chunks_exact_mut(width));
        for (row, to) in each {
            lanes.theta.iter().zip(row).for_each(|(&t, value)| to[t] = *value);
            to[width - 1] = row[common + own];
            sensitivities.extend_from_slice(&row[common..common + own]);
            plain.push(row[common + own]);
            misfit += row[common + own].powi(2);
        }
        let freedom = (places.len() as f64 - lanes.fixed_nuisances() as f64).max(1.0);
        let tolerated = at.record.tolerated;
        let weight = weight(misfit, freedom, tolerated);
        let priors = own_priors(point, lanes, at);
        let precision = priors.iter().map(|p| p.1).collect();
        let projection = Projection::new(sensitivities, precision, weight);
        let mut of_priors = projection.apply(&mut columns, width, weight);
        let left = projection.settled(&plain, &priors, weight);
        for (row, r) in columns.chunks_exact_mut(width).zip(&left) {
            row[width - 1] = *r;
        }
        for (row, r) in of_priors.chunks_exact_mut(width.max(1)).zip(&left[plain.len()..]) {
            row[width - 1] = *r;
        }
        let first = places.first().map_or(0, |p| p.0);
        let count = of_priors.len() / width.max(1);
        places.extend(std::iter::repeat_n((first, u16::MAX), count));
        columns.extend(of_priors);
        let scatter = self.fit.hypothesis.scatter.filter(|_| lanes.offsets > 0);
        let constant =
            scatter.map_or(0.0, |s| projection.factor.log_det + 2.0 * lanes.offsets as f64 * s.sd.ln());
        WindowRows {
            weight,
            freedom,
            tolerated,
            values: columns,
            places,
            priors: count,
            constant,
            own: projection,
            plain,
        }
    }

    /// Further columns of each window, projected as its rows are: sensitivities to the parameters of `system` from number `first` on, at
    /// their values `further`. Rows of priors come last.
    pub fn columns(&self, rows: &Rows, system: &dyn System, first: usize, further: &[f64]) -> Vec<Vec<f64>> {
        let points = self.points(system, first, further);
        let own: Vec<Seed> = (first..first + further.len()).map(Seed::Parameter).collect();
        let seeds: Vec<&[Seed]> = self.windows.iter().map(|_| &own[..]).collect();
        let count = further.len();
        simulated(&points, &self.lanes, &self.windows, &seeds, |w, run| {
            let (values, _) = whitened_rows(run, self.windows[w], self.sample.correlation);
            let mut columns: Vec<f64> =
                values.chunks_exact(count + 1).flat_map(|row| &row[..count]).copied().collect();
            let window = &rows.windows[w];
            let of_priors = window.own.apply(&mut columns, count, window.weight);
            columns.extend(of_priors);
            columns
        })
    }

    /// The change of the prediction in each window from that of the fit to that of `system` with these parameter values, as one column,
    /// projected as the rows are; no numbers where the system cannot be simulated.
    pub fn change(&self, rows: &Rows, system: &dyn System, first: usize, further: &[f64]) -> Vec<Vec<f64>> {
        let points = self.points(system, first, further);
        let seeds: Vec<&[Seed]> = self.windows.iter().map(|_| &[][..]).collect();
        simulated(&points, &self.lanes, &self.windows, &seeds, |w, run| {
            let (values, _) = whitened_rows(run, self.windows[w], self.sample.correlation);
            let window = &rows.windows[w];
            let mut column: Vec<f64> = window.plain.iter().zip(&values).map(|(a, b)| a - b).collect();
            let of_priors = window.own.apply(&mut column, 1, window.weight);
            column.extend(of_priors);
            column
        })
    }
}

#[cfg(test)]
impl Rows {
    /// Rows of one window of a linear model without unknowns of its own: sensitivities and residual of each row, and its block.
    pub fn of_linear_model(rows: &[(Vec<f64>, f64, u16)]) -> Self {
        let width = rows.first().map_or(1, |r| r.0.len() + 1);
        let window = WindowRows {
            weight: 1.0,
            freedom: rows.len() as f64,
            tolerated: false,
            values: rows.iter().flat_map(|(x, r, _)| x.iter().copied().chain([*r])).collect(),
            places: rows.iter().map(|(_, _, block)| (*block, 0)).collect(),
            priors: 0,
            constant: 0.0,
            own: Projection::new(Vec::new(), Vec::new(), 1.0),
            plain: Vec::new(),
        };
        Self { width, windows: vec![window] }
    }
}
