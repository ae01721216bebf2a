//! The predictions about a fit as a linear problem: one column for each candidate, sums of products by block.
//!
//! One simulation of the data gives a column its values. After that a set of candidates is an index set: its gain, its coefficients and
//! its cross-validated error follow from the sums of products in microseconds.

use super::candidates::may_join;
use super::group::{Effect, Group, acting_points, null_points};
use crate::addition::Addition;
use crate::chosen_records::ChosenRecords;
use crate::linear::Square;
use crate::score::{Blocks, Places, Rows, Scored, off_nulls};
use augsim_linear::gram_of_rows;
use augsim_physics::model::Per;
use augsim_physics::system::Law;
use rayon::prelude::*;

/// Columns of one simulation. More share the cost of the motion itself; the lanes of a pass are 32.
const BATCH: usize = 32;
/// Most columns of a problem: the sums of products of so many take as long as their simulations.
const MOST_COLUMNS: usize = 300;
/// Share of a column that has to be left beside the columns of the declared parameters: less is rounding, and no data tell it.
pub(crate) const SEEN: f64 = 1e-6;
/// Sum of squares of a column from which on products with others overflow.
const MOST: f64 = 1e100;
/// Cosine from which on two columns are one law in two forms.
const ALIAS: f64 = 1.0 - 1e-9;

/// Sums of products of one block: `J'J`, `J'r` and `r'r`.
#[derive(Clone, Debug)]
pub(crate) struct Sums {
    pub h: Square,
    pub g: Vec<f64>,
    pub c: f64,
}

impl Sums {
    /// Sums of some columns alone.
    pub fn sub(&self, columns: &[usize]) -> Self {
        Self { h: self.h.sub(columns), g: columns.iter().map(|&c| self.g[c]).collect(), c: self.c }
    }

    /// Sums with what is left of the residuals at these coefficients.
    pub fn left_at(&self, x: &[f64]) -> Self {
        let along = |i: usize| x.iter().enumerate().map(|(j, x)| self.h.at(i, j) * x).sum::<f64>();
        let g = self.g.iter().enumerate().map(|(i, g)| g - along(i)).collect();
        Self { h: self.h.clone(), g, c: self.c - self.h.fall(&self.g, x) }
    }

    /// The same with residuals of this sign.
    pub fn turned(&self, sign: f64) -> Self {
        Self { h: self.h.clone(), g: self.g.iter().map(|g| sign * g).collect(), c: self.c }
    }
}

/// Sums of products of all blocks.
pub(crate) fn summed(blocks: &[Sums]) -> Sums {
    let n = blocks.first().map_or(0, |b| b.g.len());
    let mut sum = Sums { h: Square::zero(n), g: vec![0.0; n], c: 0.0 };
    for block in blocks {
        sum.h.a.iter_mut().zip(&block.h.a).for_each(|(a, x)| *a += x);
        sum.g.iter_mut().zip(&block.g).for_each(|(a, x)| *a += x);
        sum.c += block.c;
    }
    sum
}

/// The linear problem at a fit.
pub(crate) struct LinearProblem {
    /// Columns of the declared parameters: the first ones, which every set has. Those at a bound have none.
    pub declared: Vec<usize>,
    pub groups: Vec<Group>,
    /// Numbers of the groups of the fitted set.
    pub fitted: Vec<usize>,
    pub blocks: Vec<Sums>,
    /// Number of residuals.
    samples: f64,
    /// Share of them that are independent.
    independent: f64,
    width: usize,
}

/// Columns of all windows, window by window.
type Columns = Vec<Vec<f64>>;

impl LinearProblem {
    /// The problem at a fitted set with the candidates `library` beside it.
    pub fn new(sample: &ChosenRecords<'_>, blocks: &Blocks, at: &Scored, library: &[Addition]) -> Self {
        let places = Places::new(sample, &at.fit);
        let rows = places.rows(blocks);
        let mut all = Assembled::new(&places, &rows, at);
        all.add_slopes(library);
        all.add_changes(library);
        all.add_splits(library);
        all.finish(blocks.count, at.evidence.memory.independent)
    }

    /// Sums of the blocks with what is left of the residuals after these columns were fitted.
    pub fn left_by(&self, columns: &[usize]) -> Vec<Sums> {
        let Sums { h, g: mut x, .. } = summed(&self.blocks).sub(columns);
        h.cholesky().solve(&mut x);
        let mut of_all = vec![0.0; self.width];
        columns.iter().zip(x).for_each(|(&c, x)| of_all[c] = x);
        self.blocks.iter().map(|block| block.left_at(&of_all)).collect()
    }

    /// By how much the coefficients of some columns are off the values where these change nothing: the declared parameters, which come first,
    /// have none.
    pub fn off_nulls(&self, coefficients: &[f64]) -> Vec<f64> {
        let declared = self.declared.len();
        coefficients.iter().enumerate().map(|(k, x)| if k < declared { 0.0 } else { *x }).collect()
    }

    /// Half the number of independent residuals: the factor that makes nats of the logarithm of squared errors.
    pub fn half_of_samples(&self) -> f64 {
        0.5 * self.samples * self.independent
    }

    /// Groups that may stand in a set beside these, which are not of the fitted set.
    pub fn beside(&self, set: &[usize]) -> Vec<usize> {
        let goes = |g: &usize| {
            let new = &self.groups[*g];
            !self.fitted.contains(g) && set.iter().all(|f| self.groups[*f].goes_with(new))
        };
        (0..self.groups.len()).filter(goes).collect()
    }

    /// Columns of the declared parameters and of some groups.
    pub fn columns_of(&self, groups: &[usize]) -> Vec<usize> {
        let own = groups.iter().flat_map(|g| self.groups[*g].columns.clone());
        self.declared.iter().copied().chain(own).collect()
    }
}

/// A problem while its columns are gathered.
struct Assembled<'a> {
    places: &'a Places<'a>,
    rows: &'a Rows,
    at: &'a Scored,
    declared: Vec<usize>,
    groups: Vec<Group>,
    fitted: usize,
    /// Columns gathered so far, for each window `[row][column]` in pieces.
    pieces: Vec<(usize, Columns)>,
    width: usize,
    /// Amount taken from the residual for the fitted set to be left out, by column of theta.
    shift: Vec<f64>,
}

impl<'a> Assembled<'a> {
    fn new(places: &'a Places<'a>, rows: &'a Rows, at: &'a Scored) -> Self {
        let h = &at.fit.hypothesis;
        let p = h.theta_len();
        let held = crate::score::held(&at.fit);
        let declared = (0..h.range_of_declared()).filter(|i| !held[*i]).collect();
        let mut groups = Vec::new();
        for (number, addition) in h.additions.iter().enumerate() {
            let columns = h.range_of(number);
            if columns.is_empty() || matches!(addition, Addition::Scatter(_) | Addition::Split(_)) {
                continue;
            }
            let point = at.fit.theta[columns.clone()].to_vec();
            groups.push(Group { addition: addition.clone(), point, columns, effect: Effect::Fitted });
        }
        let fitted = groups.len();
        let theta = rows.windows.iter().map(|w| {
            let each = w.values.chunks_exact(rows.width);
            each.flat_map(|row| row[..p].iter().copied()).collect()
        });
        let pieces = vec![(p, theta.collect())];
        Self { places, rows, at, declared, groups, fitted, pieces, width: p, shift: off_nulls(&at.fit) }
    }

    /// Candidates that may join the set, or take the place of one of its additions.
    fn candidates<'l>(&self, library: &'l [Addition]) -> impl Iterator<Item = &'l Addition> {
        let h = self.at.fit.hypothesis.clone();
        let rivals = move |a: &&Addition| {
            let known = h.additions.contains(a);
            let joins = a.listed().is_some_and(|effect| effect.joins.is_some());
            !known && (may_join(a, &h) || !joins && !matches!(a, Addition::Scatter(_)))
        };
        library.iter().filter(rivals)
    }

    /// Derivatives of additions at the points where they change nothing, many in one simulation.
    fn add_slopes(&mut self, library: &[Addition]) {
        let system = &self.at.fit.hypothesis.system;
        let list: Vec<(&Addition, Vec<f64>)> = self
            .candidates(library)
            .flat_map(|a| null_points(&**system, a).into_iter().map(move |point| (a, point)))
            .collect();
        let mut batches: Vec<Vec<(&Addition, Vec<f64>)>> = Vec::new();
        for costly in [false, true] {
            let mut batch = Vec::new();
            let mut size = 0;
            for (a, point) in list.iter().filter(|(a, _)| a.is_costly() == costly) {
                if size + point.len() > BATCH && !batch.is_empty() {
                    batches.push(std::mem::take(&mut batch));
                    size = 0;
                }
                size += point.len();
                batch.push((*a, point.clone()));
            }
            batches.push(batch);
        }
        batches.retain(|b| !b.is_empty());
        let done: Vec<Vec<(Group, Columns)>> = batches.par_iter().map(|batch| self.slopes(batch)).collect();
        done.into_iter().flatten().for_each(|(group, columns)| self.push(group, columns));
    }

    fn slopes(&self, batch: &[(&Addition, Vec<f64>)]) -> Vec<(Group, Columns)> {
        batch.iter().for_each(|_| self.places.sample.data.tally.score());
        let h = &self.at.fit.hypothesis;
        let laws: Vec<Law> = batch.iter().filter_map(|(a, _)| a.law()).collect();
        let Ok(system) = h.system.augmented(&laws) else { return Vec::new() };
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
            // Shape parameters have no slope where the amounts are at their nulls.
            let amounts = match addition {
                Addition::Effect(listed, _) => listed.effect.amounts.unwrap_or(point.len()).min(point.len()),
                _ => point.len(),
            };
            let own = range.start..range.start + amounts;
            let mut columns: Columns = found
                .iter()
                .map(|w| w.chunks_exact(total).flat_map(|row| row[own.clone()].iter().copied()).collect())
                .collect();
            let mut width = amounts;
            if by_group {
                (columns, width) = self.by_group(columns, amounts);
            }
            let group = Group {
                addition: (*addition).clone(),
                point: point.clone(),
                columns: 0..width,
                effect: Effect::Slopes,
            };
            out.push((group, columns));
        }
        out
    }

    /// Columns of each group of the data apart, parameter by parameter.
    fn by_group(&self, columns: Columns, width: usize) -> (Columns, usize) {
        let groups = self.places.sample.data.groups.len();
        let wide = |(w, own): (usize, Vec<f64>)| {
            let group = self.places.windows[w].record.seen.group;
            let spread = |row: &[f64]| {
                let mut out = vec![0.0; width * groups];
                row.iter().enumerate().for_each(|(k, x)| out[k * groups + group] = *x);
                out
            };
            own.chunks_exact(width.max(1)).flat_map(spread).collect()
        };
        (columns.into_iter().enumerate().map(wide).collect(), width * groups)
    }

    /// Changes by additions at points where they act, each with the derivatives with respect to its parameters there.
    fn add_changes(&mut self, library: &[Addition]) {
        let h = &self.at.fit.hypothesis;
        let list: Vec<(&Addition, Vec<f64>)> = self
            .candidates(library)
            .flat_map(|a| acting_points(&*h.system, a).into_iter().map(move |point| (a, point)))
            .collect();
        let change = |(addition, point): &(&Addition, Vec<f64>)| {
            self.places.sample.data.tally.score();
            let system = h.system.augmented(&[addition.law()?]).ok()?;
            let first = h.system.parameters().len();
            let whole = self.places.change(self.rows, &*system, first, point);
            let slopes = self.places.columns(self.rows, &*system, first, point);
            let count = point.len();
            let both = whole.iter().zip(&slopes).map(|(whole, slopes)| {
                let row = |(k, x): (usize, &f64)| [&[*x], &slopes[k * count..][..count]].concat();
                whole.iter().enumerate().flat_map(row).collect()
            });
            let (addition, point) = ((*addition).clone(), point.clone());
            let columns = both.collect();
            Some((Group { addition, point, columns: 0..1 + count, effect: Effect::Change }, columns))
        };
        let done: Vec<Option<(Group, Columns)>> = list.par_iter().map(change).collect();
        done.into_iter().flatten().for_each(|(group, columns)| self.push(group, columns));
    }

    /// Values of declared parameters by group: the column of the parameter in each group but the first.
    fn add_splits(&mut self, library: &[Addition]) {
        let h = &self.at.fit.hypothesis;
        let groups = self.places.sample.data.groups.len();
        let splits: Vec<(Addition, usize)> = self
            .candidates(library)
            .filter_map(|a| match a {
                Addition::Split(split) => {
                    let entry = h.entries_of(split.index).filter(|entries| entries.len() == 1)?;
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
            let group = Group { addition, point: Vec::new(), columns: 0..groups - 1, effect: Effect::Split };
            self.push(group, columns);
        }
    }

    /// Takes the columns of a group in, if all of their values are numbers.
    fn push(&mut self, group: Group, columns: Columns) {
        let count = group.columns.len();
        // Derivatives that grow without bound along a run have squares that are no numbers.
        let squares: f64 = columns.iter().flatten().map(|x| x * x).sum();
        if count == 0 || !(squares > 0.0 && squares < MOST) {
            return;
        }
        self.groups.push(Group { columns: self.width..self.width + count, ..group });
        self.pieces.push((count, columns));
        self.width += count;
    }

    fn finish(mut self, blocks: usize, independent: f64) -> LinearProblem {
        self.keep_the_best();
        let n = self.width;
        let rows: Vec<Vec<f64>> =
            (0..self.rows.windows.len()).into_par_iter().map(|w| self.window(w)).collect();
        let places: Vec<Vec<u16>> =
            self.rows.windows.iter().map(|w| w.places.iter().map(|p| p.0).collect()).collect();
        let of = |block: usize| {
            let mine = rows.iter().zip(&places).flat_map(|(rows, places)| {
                rows.chunks_exact(n + 1).zip(places).filter(|(_, b)| usize::from(**b) == block)
            });
            let all: Vec<f64> = mine.flat_map(|(row, _)| row.iter().copied()).collect();
            let sums = gram_of_rows(&all, n + 1);
            let mut h = Square::zero(n);
            (0..n).for_each(|i| h.a[i * n..][..n].copy_from_slice(&sums[i * (n + 1)..][..n]));
            let g = (0..n).map(|i| sums[i * (n + 1) + n]).collect();
            Sums { h, g, c: sums[n * (n + 1) + n] }
        };
        let sums: Vec<Sums> = (0..blocks).into_par_iter().map(of).collect();
        let samples = self.rows.windows.iter().map(|w| w.places.len() - w.priors).sum::<usize>() as f64;
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
        problem.leave_out_aliases();
        problem
    }

    /// Rows of a window, weighted: all columns and the residual of the declared model's part.
    fn window(&self, w: usize) -> Vec<f64> {
        let window = &self.rows.windows[w];
        let count = window.places.len();
        let measured = count - window.priors;
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

    /// Keeps the candidates that gain most one by one, where there are too many for sums of all their products.
    fn keep_the_best(&mut self) {
        if self.width <= MOST_COLUMNS {
            return;
        }
        let gains: Vec<f64> =
            (self.fitted..self.groups.len()).into_par_iter().map(|g| self.gain(g)).collect();
        let mut order: Vec<usize> = (0..gains.len()).collect();
        order.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]).then(a.cmp(&b)));
        let mut width = self.pieces[0].0;
        let mut kept: Vec<usize> = Vec::new();
        for k in order {
            let own = self.groups[self.fitted + k].columns.len();
            if width + own <= MOST_COLUMNS {
                width += own;
                kept.push(self.fitted + k);
            }
        }
        kept.sort_unstable();
        let theta = self.pieces[0].0;
        let (groups, pieces) = (std::mem::take(&mut self.groups), std::mem::take(&mut self.pieces));
        let mut at = theta;
        let mut pieces = pieces.into_iter().map(Some).collect::<Vec<_>>();
        self.pieces.extend(pieces[0].take());
        for (g, group) in groups.into_iter().enumerate() {
            if g < self.fitted {
                self.groups.push(group);
            } else if kept.binary_search(&g).is_ok() {
                let count = group.columns.len();
                self.groups.push(Group { columns: at..at + count, ..group });
                self.pieces.extend(pieces[1 + g - self.fitted].take());
                at += count;
            }
        }
        self.width = at;
    }

    /// Gain of a candidate beside the fitted set.
    fn gain(&self, g: usize) -> f64 {
        let (count, columns) = &self.pieces[1 + g - self.fitted];
        let p = self.pieces[0].0;
        let n = p + count;
        let (mut h, mut u) = (Square::zero(n), vec![0.0; n]);
        for (w, window) in self.rows.windows.iter().enumerate() {
            let rows = window.values.chunks_exact(self.rows.width).zip(columns[w].chunks_exact(*count));
            for (row, own) in rows {
                let at = |i: usize| if i < p { row[i] } else { own[i - p] };
                for (i, gradient) in u.iter_mut().enumerate().skip(p) {
                    *gradient += window.weight * at(i) * row[p];
                    (0..=i).for_each(|j| *h.at_mut(i, j) += window.weight * at(i) * at(j));
                }
                for i in 0..p {
                    (0..=i).for_each(|j| *h.at_mut(i, j) += window.weight * at(i) * at(j));
                }
            }
        }
        (0..n).for_each(|i| (0..i).for_each(|j| *h.at_mut(j, i) = h.at(i, j)));
        let order: Vec<usize> = (p..n).chain(0..p).collect();
        let gradient: Vec<f64> = order.iter().map(|&i| u[i]).collect();
        let (s, mut v, _) = crate::linear::eliminate(&h.sub(&order), &gradient, *count);
        let raw: Vec<f64> = (p..n).map(|i| h.at(i, i)).collect();
        let seen = (0..*count).all(|i| s.at(i, i) > SEEN * raw[i]);
        s.cholesky().forward(&mut v);
        if seen { v.iter().map(|x| x * x).sum() } else { 0.0 }
    }
}

impl LinearProblem {
    /// Leaves out single columns that repeat an earlier one: the same law under a name that comes later in the library.
    fn leave_out_aliases(&mut self) {
        let sum = summed(&self.blocks);
        let size = |c: usize| sum.h.at(c, c).sqrt();
        let single: Vec<(usize, usize)> = (0..self.groups.len())
            .filter(|g| self.groups[*g].columns.len() == 1)
            .map(|g| (g, self.groups[g].columns.start))
            .collect();
        let repeats = |(g, c): &(usize, usize)| {
            !self.fitted.contains(g)
                && single.iter().take_while(|(other, _)| other < g).any(|(other, d)| {
                    let cosine = sum.h.at(*c, *d) / (size(*c) * size(*d));
                    let same = self.groups[*g].addition.kind() == self.groups[*other].addition.kind();
                    !same && cosine.abs() > ALIAS
                })
        };
        let gone: Vec<usize> = single.iter().filter(|s| repeats(s)).map(|(g, _)| *g).collect();
        let mut number = 0;
        self.groups.retain(|_| {
            number += 1;
            !gone.contains(&(number - 1))
        });
    }
}
