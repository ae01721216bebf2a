//! Selection of sets in the linear problem: forward, backward and by exchange.

use super::refit::{Price, Search};
use crate::columns::{LinearProblem, SEEN, Sums, summed};
use crate::linear::{Cholesky, Square};
use crate::score::{distance, freedom, move_without};
use crate::statistics::hotelling_tail;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Candidates of each step whose cross-validated error is worked out: by the gain that all data show.
const LOOKED_AT: usize = 6;
/// Steps forward that may bring no gain: two laws that are both needed may each be useless alone.
const PATIENCE: usize = 2;
/// Most effects of a set.
pub(crate) const MOST_EFFECTS: usize = 5;

/// A set in the linear problem.
#[derive(Clone, Debug)]
pub(crate) struct Chosen {
    /// Groups, in rising order.
    pub groups: Vec<usize>,
    /// Gain over the declared model less the price, in nats.
    pub value: f64,
    /// Coefficients of the columns of the declared parameters and of the groups in order.
    pub coefficients: Vec<f64>,
}

/// One selection.
struct Selection<'p> {
    problem: &'p LinearProblem,
    blocks: &'p [Sums],
    h: Square,
    g: Vec<f64>,
    price: Price,
    /// Logarithm of the squared error of the declared model.
    base: f64,
}

/// The sets that a selection passes, by value, best first; the fitted set among them.
pub(crate) fn select(problem: &LinearProblem, price: Price) -> Vec<Chosen> {
    let selection = Selection::new(problem, &problem.blocks, price);
    let mut passed = BTreeMap::new();
    selection.walk(&problem.fitted, &mut passed);
    if !problem.fitted.is_empty() {
        selection.walk(&[], &mut passed);
    }
    let mut all: Vec<Chosen> = passed.into_values().flatten().collect();
    all.sort_by(|a, b| b.value.total_cmp(&a.value).then(a.groups.cmp(&b.groups)));
    all
}

/// The best set of other residuals, with their sums.
pub(crate) struct Selected {
    pub chosen: Chosen,
    blocks: Vec<Sums>,
}

/// The best set where the sums of the blocks are these.
pub(crate) fn select_of(problem: &LinearProblem, blocks: Vec<Sums>, price: Price) -> Selected {
    let chosen = best_of(&Selection::new(problem, &blocks, price));
    Selected { chosen, blocks }
}

/// Whether every group of a selected set is significant at the level of its addition.
pub(crate) fn is_significant(problem: &LinearProblem, set: &Selected, search: &Search<'_>) -> bool {
    let groups = &set.chosen.groups;
    let level = |g: &usize| search.level(&problem.groups[*g].addition);
    chances(problem, &set.blocks, groups).iter().zip(groups).all(|(p, g)| *p <= level(g))
}

/// Probability that chance alone moves the coefficients of each group of a set as far from 0, by the scatter over left-out blocks.
pub(crate) fn chances(problem: &LinearProblem, blocks: &[Sums], groups: &[usize]) -> Vec<f64> {
    let columns = problem.columns_of(groups);
    let own: Vec<Sums> = blocks.iter().map(|b| b.sub(&columns)).collect();
    let Sums { h, g: mut x, .. } = summed(&own);
    h.cholesky().solve(&mut x);
    let off_nulls = problem.off_nulls(&x);
    let moved = |block: &Sums| {
        let at_x = block.left_at(&x);
        move_without(&h, &at_x.h, &at_x.g, &off_nulls)
    };
    let moves: Vec<Vec<f64>> = own.iter().map(moved).collect();
    let mut at = problem.declared.len();
    let each = groups.iter().map(|group| {
        let entries: Vec<usize> = (at..at + problem.groups[*group].columns.len()).collect();
        at += entries.len();
        let off: Vec<f64> = entries.iter().map(|&i| x[i]).collect();
        let freedom = freedom(&h, own.iter().map(|block| &block.h), &entries);
        hotelling_tail(distance(&moves, &entries, &off, 0), entries.len(), freedom)
    });
    each.collect()
}

/// The same of each group that may stand beside these, with it.
pub(crate) fn chances_beside(problem: &LinearProblem, set: &[usize]) -> Vec<f64> {
    let chance = |g: usize| {
        let with = [set, &[g]].concat();
        chances(problem, &problem.blocks, &with).pop().unwrap_or(1.0)
    };
    problem.beside(set).into_par_iter().map(chance).collect()
}

fn best_of(selection: &Selection<'_>) -> Chosen {
    let mut passed = BTreeMap::new();
    selection.walk(&[], &mut passed);
    let all = passed.into_values().flatten();
    let none = Chosen { groups: Vec::new(), value: 0.0, coefficients: Vec::new() };
    all.fold(none, |best, one| if one.value > best.value { one } else { best })
}

/// Sets that a selection has passed, by their groups; nothing for those that cannot stand.
type Passed = BTreeMap<Vec<usize>, Option<Chosen>>;

impl<'p> Selection<'p> {
    fn new(problem: &'p LinearProblem, blocks: &'p [Sums], price: Price) -> Self {
        let Sums { h, g, .. } = summed(blocks);
        let mut new = Self { problem, blocks, h, g, price, base: 0.0 };
        new.base = new.error(&problem.declared).0;
        new
    }

    /// From a set forward, backward and by exchange, until nothing is better.
    fn walk(&self, from: &[usize], passed: &mut Passed) {
        let Some(mut best) = self.look_at(from.to_vec(), passed) else { return };
        loop {
            let before = best.value;
            best = self.forward(best, passed);
            best = self.backward(best, passed);
            best = self.exchange(best, passed);
            if best.value <= before {
                return;
            }
        }
    }

    fn forward(&self, from: Chosen, passed: &mut Passed) -> Chosen {
        let (mut best, mut front, mut idle) = (from.clone(), from, 0);
        while idle < PATIENCE && front.groups.len() < MOST_EFFECTS {
            let joined = self.strongest(&front.groups, LOOKED_AT, passed);
            let Some(next) = joined.into_iter().max_by(|a, b| a.value.total_cmp(&b.value)) else { break };
            front = next;
            if front.value > best.value {
                best = front.clone();
                idle = 0;
            } else {
                idle += 1;
            }
        }
        best
    }

    fn backward(&self, from: Chosen, passed: &mut Passed) -> Chosen {
        let mut best = from;
        loop {
            let less = (0..best.groups.len()).filter_map(|k| {
                let mut rest = best.groups.clone();
                rest.remove(k);
                self.look_at(rest, passed)
            });
            match less.max_by(|a, b| a.value.total_cmp(&b.value)) {
                Some(less) if less.value > best.value => best = less,
                _ => return best,
            }
        }
    }

    fn exchange(&self, from: Chosen, passed: &mut Passed) -> Chosen {
        let mut best = from.clone();
        for k in 0..from.groups.len() {
            let mut rest = from.groups.clone();
            rest.remove(k);
            for other in self.strongest(&rest, LOOKED_AT, passed) {
                if other.value > best.value {
                    best = other;
                }
            }
        }
        best
    }

    /// The sets with one more group that gain most by all data.
    fn strongest(&self, groups: &[usize], most: usize, passed: &mut Passed) -> Vec<Chosen> {
        let mut gains = self.gains(groups);
        gains.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        // Points of one addition are one candidate: its best ones alone are looked at.
        let mut seen: Vec<String> = Vec::new();
        gains.retain(|(_, g)| {
            let label = self.problem.groups[*g].addition.label();
            let fresh = !seen.contains(&label);
            seen.push(label);
            fresh
        });
        let with = |(_, g): &(f64, usize)| {
            let mut all = groups.to_vec();
            all.push(*g);
            all.sort_unstable();
            self.look_at(all, passed)
        };
        gains.iter().take(most).filter_map(with).collect()
    }

    /// Gain of each group that may join a set by all data.
    fn gains(&self, groups: &[usize]) -> Vec<(f64, usize)> {
        let columns = self.problem.columns_of(groups);
        let factor = self.h.sub(&columns).cholesky();
        let own: Vec<f64> = columns.iter().map(|&c| self.g[c]).collect();
        let mut reached = own;
        factor.forward(&mut reached);
        let joins = |g: &usize| {
            let new = &self.problem.groups[*g];
            groups.iter().all(|other| other != g && self.problem.groups[*other].goes_with(new))
        };
        let gain = |g: usize| Some((self.gain_of(g, &columns, &factor, &reached)?, g));
        (0..self.problem.groups.len()).filter(joins).filter_map(gain).collect()
    }

    fn gain_of(&self, g: usize, columns: &[usize], factor: &Cholesky, reached: &[f64]) -> Option<f64> {
        let group = &self.problem.groups[g];
        let own: Vec<usize> = group.columns.clone().collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let along: Vec<Vec<f64>> = own
            .iter()
            .map(|&c| {
                let mut x: Vec<f64> = columns.iter().map(|&d| self.h.at(c, d)).collect();
                factor.forward(&mut x);
                x
            })
            .collect();
        let mut s = Square::zero(own.len());
        for (i, &c) in own.iter().enumerate() {
            (0..own.len()).for_each(|j| *s.at_mut(i, j) = self.h.at(c, own[j]) - dot(&along[i], &along[j]));
        }
        let seen: Vec<usize> =
            (0..own.len()).filter(|&i| s.at(i, i) > SEEN * self.h.at(own[i], own[i])).collect();
        if seen.is_empty() {
            return None;
        }
        let mut u: Vec<f64> = seen.iter().map(|&i| self.g[own[i]] - dot(&along[i], reached)).collect();
        let factor = s.sub(&seen).cholesky();
        let mut step = u.clone();
        factor.solve(&mut step);
        let mut all = vec![0.0; own.len()];
        seen.iter().zip(&step).for_each(|(&i, d)| all[i] = *d);
        factor.forward(&mut u);
        group.allows(&all).then(|| u.iter().map(|x| x * x).sum())
    }

    /// A set with its value; nothing where a column is not told beside the others, or an amount has a value that it cannot have.
    fn look_at(&self, groups: Vec<usize>, passed: &mut Passed) -> Option<Chosen> {
        if let Some(known) = passed.get(&groups) {
            return known.clone();
        }
        let chosen = self.chosen(groups.clone());
        passed.insert(groups, chosen.clone());
        chosen
    }

    fn chosen(&self, groups: Vec<usize>) -> Option<Chosen> {
        let columns = self.problem.columns_of(&groups);
        let (error, coefficients) = self.error(&columns);
        let mut at = self.problem.declared.len();
        for g in &groups {
            let group = &self.problem.groups[*g];
            let own = &coefficients[at..at + group.columns.len()];
            at += own.len();
            if !group.allows(own) {
                return None;
            }
        }
        let gain = self.problem.half_of_samples() * (self.base - error);
        let price = |g: &usize| self.price.of(&self.problem.groups[*g].addition);
        let value = gain - groups.iter().map(price).sum::<f64>();
        value.is_finite().then_some(Chosen { groups, value, coefficients })
    }

    /// Logarithm of the squared error of predictions by some columns, and their coefficients by all data.
    fn error(&self, columns: &[usize]) -> (f64, Vec<f64>) {
        let h = self.h.sub(columns);
        let mut x: Vec<f64> = columns.iter().map(|&c| self.g[c]).collect();
        h.cholesky().solve(&mut x);
        let off_nulls = self.problem.off_nulls(&x);
        let left_out = |block: &Sums| {
            let at_x = block.sub(columns).left_at(&x);
            at_x.c - at_x.h.fall(&at_x.g, &move_without(&h, &at_x.h, &at_x.g, &off_nulls))
        };
        let sum: f64 = self.blocks.iter().map(left_out).sum();
        (sum.max(f64::MIN_POSITIVE).ln(), x)
    }
}
