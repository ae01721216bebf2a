//! Builder of a linear problem: simulates the candidates, and collects the columns of their changes.

use super::candidates::can_join;
use crate::addition::Addition;
use crate::linear::Square;
use crate::linear_problem::{
    BlockSums, ColumnGroup, ColumnKind, LinearProblem, MIN_INDEPENDENT_SHARE, acting_points, null_points,
};
use crate::score::{FitWindows, Rows, Scored, distances_from_nulls};
use augsim_linear::gram_of_rows;
use augsim_system::{ModelTerm, Per};
use rayon::prelude::*;

/// Maximum number of columns per simulation. More share the cost of the motion, but a SIMD pass has 32 lanes.
const BATCH_COLUMNS: usize = 32;
/// Maximum number of columns of a linear problem. The sums of products of this many take as long as the
/// simulations.
const MAX_COLUMNS: usize = 300;
/// Sum of squares of a column above which its products with others would overflow.
const MAX_COLUMN_SQUARES: f64 = 1e100;

/// Values of some columns, `[window]`, stored by rows within each window.
pub(super) type Columns = Vec<Vec<f64>>;

/// Divides additions and their parameter values into batches that are simulated together.
pub(super) fn batches<'l>(list: &[(&'l Addition, Vec<f64>)]) -> Vec<Vec<(&'l Addition, Vec<f64>)>> {
    let mut batches: Vec<Vec<(&Addition, Vec<f64>)>> = Vec::new();
    for costly in [false, true] {
        let mut batch = Vec::new();
        let mut size = 0;
        for (a, point) in list.iter().filter(|(a, _)| a.is_costly() == costly) {
            if size + point.len() > BATCH_COLUMNS && !batch.is_empty() {
                batches.push(std::mem::take(&mut batch));
                size = 0;
            }
            size += point.len();
            batch.push((*a, point.clone()));
        }
        batches.push(batch);
    }
    batches.retain(|b| !b.is_empty());
    batches
}

/// Builder of a linear problem from simulations of the candidates.
pub(super) struct ProblemBuilder<'a> {
    places: &'a FitWindows<'a>,
    rows: &'a Rows,
    at: &'a Scored,
    declared: Vec<usize>,
    groups: Vec<ColumnGroup>,
    fitted: usize,
    /// Columns so far, in batches: number of columns in the batch, and their values by window.
    pieces: Vec<(usize, Columns)>,
    width: usize,
    /// For each column of theta (the shared parameters): the distance from null by which fitted additions are
    /// removed from the residual.
    shift: Vec<f64>,
}

impl<'a> ProblemBuilder<'a> {
    pub(super) fn new(places: &'a FitWindows<'a>, rows: &'a Rows, set: &'a Scored) -> Self {
        let h = &set.fit.hypothesis;
        let p = h.theta_len();
        let held = crate::score::entries_at_bounds(&set.fit);
        let declared = (0..h.declared_entries()).filter(|i| !held[*i]).collect();
        let mut groups = Vec::new();
        for (number, addition) in h.additions.iter().enumerate() {
            let columns = h.entries_of_addition(number);
            if columns.is_empty() || matches!(addition, Addition::Scatter(_) | Addition::Split(_)) {
                continue;
            }
            let point = set.fit.theta[columns.clone()].to_vec();
            groups.push(ColumnGroup { addition: addition.clone(), point, columns, kind: ColumnKind::Fitted });
        }
        let fitted = groups.len();
        let theta = rows.windows.iter().map(|w| {
            let rows_of_window = w.values.chunks_exact(rows.width);
            rows_of_window.flat_map(|row| row[..p].iter().copied()).collect()
        });
        let pieces = vec![(p, theta.collect())];
        Self {
            places,
            rows,
            at: set,
            declared,
            groups,
            fitted,
            pieces,
            width: p,
            shift: distances_from_nulls(&set.fit),
        }
    }

    /// Candidates in `library` that can join the fitted set or replace one of its additions.
    pub(super) fn candidates<'l>(&self, library: &'l [Addition]) -> impl Iterator<Item = &'l Addition> {
        let h = self.at.fit.hypothesis.clone();
        let need_shared = h.system.groupwise_effects_need_shared();
        let is_candidate = move |a: &&Addition| {
            let known = h.additions.contains(a);
            let joins = a.listed().is_some_and(|effect| effect.joins.is_some());
            let is_tried = match a {
                Addition::Effect(listed, Per::Group) if need_shared => {
                    h.additions.contains(&Addition::Effect(listed.clone(), Per::All))
                }
                _ => true,
            };
            !known && is_tried && (can_join(a, &h) || !joins && !matches!(a, Addition::Scatter(_)))
        };
        library.iter().filter(is_candidate)
    }

    /// Adds columns with the derivatives at the null values of candidates, many in one simulation.
    ///
    /// Periodic effects have columns at the points `cycles`, if these contain any.
    pub(super) fn add_slopes(&mut self, library: &[Addition], cycles: &[(&Addition, Vec<f64>)]) {
        let system = &self.at.fit.hypothesis.system;
        let has_no_cycles = |a: &&Addition| cycles.iter().all(|(periodic, _)| periodic != a);
        let list: Vec<(&Addition, Vec<f64>)> = self
            .candidates(library)
            .filter(has_no_cycles)
            .flat_map(|a| null_points(&**system, a).into_iter().map(move |point| (a, point)))
            .chain(cycles.iter().cloned())
            .collect();
        let batches = batches(&list);
        let done: Vec<Vec<(ColumnGroup, Columns)>> =
            batches.par_iter().map(|batch| self.slopes(batch)).collect();
        done.into_iter().flatten().for_each(|(group, columns)| self.push(group, columns));
    }

    /// Columns with the derivatives of one batch of candidates at their null values.
    pub(super) fn slopes(&self, batch: &[(&Addition, Vec<f64>)]) -> Vec<(ColumnGroup, Columns)> {
        batch.iter().for_each(|_| self.places.sample.data.work.count_score());
        let h = &self.at.fit.hypothesis;
        let terms: Vec<ModelTerm> = batch.iter().filter_map(|(a, _)| a.term()).collect();
        let is_over = self.places.sample.data.clock.is_over();
        let Some(system) = h.system.augmented(&terms).ok().filter(|_| !is_over) else { return Vec::new() };
        let values: Vec<f64> = batch.iter().flat_map(|(_, point)| point.iter().copied()).collect();
        let first = h.system.parameters().len();
        let found = self.places.columns(self.rows, &*system, first, &values);
        let total = values.len();
        let mut from = 0;
        let mut out = Vec::new();
        for (addition, point) in batch {
            let range = from..from + point.len();
            from = range.end;
            let by_group = matches!(addition, Addition::Effect(_, Per::Group));
            // At the nulls of the amplitudes, shape parameters have no derivative.
            let amplitudes = match addition {
                Addition::Effect(listed, _) => {
                    listed.effect.amplitude_count.unwrap_or(point.len()).min(point.len())
                }
                _ => point.len(),
            };
            let used = range.start..range.start + amplitudes;
            let mut columns: Columns = found
                .iter()
                .map(|w| w.chunks_exact(total).flat_map(|row| row[used.clone()].iter().copied()).collect())
                .collect();
            let mut width = amplitudes;
            if by_group {
                (columns, width) = self.by_group(columns, amplitudes);
            }
            let group = ColumnGroup {
                addition: (*addition).clone(),
                point: point.clone(),
                columns: 0..width,
                kind: ColumnKind::Slopes,
            };
            out.push((group, columns));
        }
        out
    }

    /// Expands columns to separate columns for each group of records, parameter by parameter. Also returns
    /// their number.
    fn by_group(&self, columns: Columns, width: usize) -> (Columns, usize) {
        let groups = self.places.sample.data.groups.len();
        let expand = |(w, values): (usize, Vec<f64>)| {
            let group = self.places.windows[w].record.data.group;
            let expand_row = |row: &[f64]| {
                let mut out = vec![0.0; width * groups];
                row.iter().enumerate().for_each(|(k, x)| out[k * groups + group] = *x);
                out
            };
            values.chunks_exact(width.max(1)).flat_map(expand_row).collect()
        };
        (columns.into_iter().enumerate().map(expand).collect(), width * groups)
    }

    /// Adds columns with the changes that candidates cause at points where they act, and the derivatives
    /// there.
    pub(super) fn add_changes(&mut self, library: &[Addition]) {
        let h = &self.at.fit.hypothesis;
        let list: Vec<(&Addition, Vec<f64>)> = self
            .candidates(library)
            .flat_map(|a| acting_points(&*h.system, a).into_iter().map(move |point| (a, point)))
            .collect();
        let change = |(addition, point): &(&Addition, Vec<f64>)| {
            self.places.sample.data.work.count_score();
            let is_over = self.places.sample.data.clock.is_over();
            let system = h.system.augmented(&[addition.term()?]).ok().filter(|_| !is_over)?;
            let first = h.system.parameters().len();
            let total = self.places.change(self.rows, &*system, first, point);
            let slopes = self.places.columns(self.rows, &*system, first, point);
            let count = point.len();
            let both = total.iter().zip(&slopes).map(|(total, slopes)| {
                let row = |(k, x): (usize, &f64)| [&[*x], &slopes[k * count..][..count]].concat();
                total.iter().enumerate().flat_map(row).collect()
            });
            let (addition, point) = ((*addition).clone(), point.clone());
            let columns = both.collect();
            Some((ColumnGroup { addition, point, columns: 0..1 + count, kind: ColumnKind::Change }, columns))
        };
        let done: Vec<Option<(ColumnGroup, Columns)>> = list.par_iter().map(change).collect();
        done.into_iter().flatten().for_each(|(group, columns)| self.push(group, columns));
    }

    /// Adds columns for groupwise values of declared parameters: the parameter's column in each group but the
    /// first.
    pub(super) fn add_splits(&mut self, library: &[Addition]) {
        let h = &self.at.fit.hypothesis;
        let groups = self.places.sample.data.groups.len();
        let splits: Vec<(Addition, usize)> = self
            .candidates(library)
            .filter_map(|a| match a {
                Addition::Split(split) => {
                    let entry = h.entries_of_parameter(split.index).filter(|entries| entries.len() == 1)?;
                    Some((a.clone(), entry.start))
                }
                _ => None,
            })
            .collect();
        for (addition, entry) in splits {
            let column = |window: &crate::score::WindowRows| -> Vec<f64> {
                window.values.chunks_exact(self.rows.width).map(|row| row[entry]).collect()
            };
            let single: Columns = self.rows.windows.iter().map(column).collect();
            let (wide, _) = self.by_group(single, 1);
            let columns = wide
                .into_iter()
                .map(|w| w.chunks_exact(groups).flat_map(|row| row[1..].iter().copied()).collect())
                .collect();
            let group =
                ColumnGroup { addition, point: Vec::new(), columns: 0..groups - 1, kind: ColumnKind::Split };
            self.push(group, columns);
        }
    }

    /// Adds the columns of a group, unless a value is not finite or all are 0.
    fn push(&mut self, group: ColumnGroup, columns: Columns) {
        let count = group.columns.len();
        // Derivatives that grow without bound along a simulation have non-finite squares.
        let squares: f64 = columns.iter().flatten().map(|x| x * x).sum();
        if count == 0 || !(squares > 0.0 && squares < MAX_COLUMN_SQUARES) {
            return;
        }
        self.groups.push(ColumnGroup { columns: self.width..self.width + count, ..group });
        self.pieces.push((count, columns));
        self.width += count;
    }

    /// Completes the linear problem: forms the sums of products by block and drops repeated columns.
    pub(super) fn finish(mut self, blocks: usize, independent: f64) -> LinearProblem {
        self.keep_strongest();
        let n = self.width;
        let rows: Vec<Vec<f64>> =
            (0..self.rows.windows.len()).into_par_iter().map(|w| self.window(w)).collect();
        let places: Vec<Vec<u16>> =
            self.rows.windows.iter().map(|w| w.block_and_channel.iter().map(|p| p.0).collect()).collect();
        let sums_of = |block: usize| {
            let block_rows = rows.iter().zip(&places).flat_map(|(rows, places)| {
                rows.chunks_exact(n + 1).zip(places).filter(|(_, b)| usize::from(**b) == block)
            });
            let values: Vec<f64> = block_rows.flat_map(|(row, _)| row.iter().copied()).collect();
            let sums = gram_of_rows(&values, n + 1);
            let mut h = Square::zero(n);
            (0..n).for_each(|i| h.a[i * n..][..n].copy_from_slice(&sums[i * (n + 1)..][..n]));
            let g = (0..n).map(|i| sums[i * (n + 1) + n]).collect();
            BlockSums { h, g, c: sums[n * (n + 1) + n] }
        };
        let sums: Vec<BlockSums> = (0..blocks).into_par_iter().map(sums_of).collect();
        let samples = self.rows.samples() as f64;
        let fitted = (0..self.fitted).collect();
        let mut problem = LinearProblem {
            declared: self.declared,
            groups: self.groups,
            fitted,
            blocks: sums,
            samples,
            independent,
            width: n,
        };
        problem.drop_aliases();
        problem
    }

    /// Weighted rows of a window: the values in all columns, and the residual without the fitted additions.
    fn window(&self, w: usize) -> Vec<f64> {
        let window = &self.rows.windows[w];
        let count = window.block_and_channel.len();
        let measured = window.samples();
        let root = window.weight.sqrt();
        let mut out = Vec::with_capacity(count * (self.width + 1));
        for k in 0..count {
            let scale = if k < measured { root } else { 1.0 };
            for (width, columns) in &self.pieces {
                out.extend(columns[w][k * width..(k + 1) * width].iter().map(|x| scale * x));
            }
            let row = &window.values[k * self.rows.width..(k + 1) * self.rows.width];
            let shifted = row.iter().zip(&self.shift).map(|(x, d)| x * d).sum::<f64>();
            out.push(scale * (row[self.rows.width - 1] + shifted));
        }
        out
    }

    /// If there are too many columns, keeps the candidates with the largest gains when added alone.
    fn keep_strongest(&mut self) {
        if self.width <= MAX_COLUMNS {
            return;
        }
        let declared = self.declared_products();
        let gains: Vec<f64> = self.pieces[1..]
            .par_iter()
            .map(|(count, columns)| self.gain(*count, columns, &declared))
            .collect();
        let mut order: Vec<usize> = (0..gains.len()).collect();
        order.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]).then(a.cmp(&b)));
        let mut width = self.pieces[0].0;
        let mut kept: Vec<usize> = Vec::new();
        for k in order {
            let count = self.groups[self.fitted + k].columns.len();
            if width + count <= MAX_COLUMNS {
                width += count;
                kept.push(self.fitted + k);
            }
        }
        kept.sort_unstable();
        let theta = self.pieces[0].0;
        let (groups, pieces) = (std::mem::take(&mut self.groups), std::mem::take(&mut self.pieces));
        let mut next = theta;
        let mut pieces = pieces.into_iter().map(Some).collect::<Vec<_>>();
        self.pieces.extend(pieces[0].take());
        for (g, group) in groups.into_iter().enumerate() {
            if g < self.fitted {
                self.groups.push(group);
            } else if kept.binary_search(&g).is_ok() {
                let count = group.columns.len();
                self.groups.push(ColumnGroup { columns: next..next + count, ..group });
                self.pieces.extend(pieces[1 + g - self.fitted].take());
                next += count;
            }
        }
        self.width = next;
    }

    /// Products of the columns of theta with each other, weighted over all windows.
    pub(super) fn declared_products(&self) -> Square {
        let p = self.pieces[0].0;
        let mut h = Square::zero(p);
        for window in &self.rows.windows {
            let sums = gram_of_rows(&window.values, self.rows.width);
            for i in 0..p {
                (0..p).for_each(|j| *h.at_mut(i, j) += window.weight * sums[i * self.rows.width + j]);
            }
        }
        h
    }

    /// Gain of a single candidate with `count` columns when added to the fitted set; 0 if its columns are not
    /// independent. `declared` are the products of the columns of theta.
    pub(super) fn gain(&self, count: usize, columns: &Columns, declared: &Square) -> f64 {
        let p = self.pieces[0].0;
        let n = p + count;
        let (mut h, mut u) = (Square::zero(n), vec![0.0; n]);
        (0..p).for_each(|i| h.a[i * n..][..p].copy_from_slice(&declared.a[i * p..][..p]));
        for (w, window) in self.rows.windows.iter().enumerate() {
            let rows = window.values.chunks_exact(self.rows.width).zip(columns[w].chunks_exact(count));
            // An effect on one output has no derivatives in the rows of the others.
            for (row, candidate) in rows.filter(|(_, candidate)| candidate.iter().any(|x| *x != 0.0)) {
                for (i, value) in candidate.iter().enumerate() {
                    let weighted = window.weight * value;
                    u[p + i] += weighted * row[p];
                    let line = &mut h.a[(p + i) * n..][..n];
                    line[..p].iter_mut().zip(row).for_each(|(sum, x)| *sum += weighted * x);
                    line[p..=p + i].iter_mut().zip(candidate).for_each(|(sum, x)| *sum += weighted * x);
                }
            }
        }
        (0..n).for_each(|i| (0..i).for_each(|j| *h.at_mut(j, i) = h.at(i, j)));
        let order: Vec<usize> = (p..n).chain(0..p).collect();
        let gradient: Vec<f64> = order.iter().map(|&i| u[i]).collect();
        let (s, mut v, _) = crate::linear::eliminate(&h.sub(&order), &gradient, count);
        let raw: Vec<f64> = (p..n).map(|i| h.at(i, i)).collect();
        let is_independent = (0..count).all(|i| s.at(i, i) > MIN_INDEPENDENT_SHARE * raw[i]);
        s.cholesky().forward(&mut v);
        if is_independent { v.iter().map(|x| x * x).sum() } else { 0.0 }
    }
}
