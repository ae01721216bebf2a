//! Selection of sets in the linear problem: forward, backward and by exchange.

use super::refit::{Penalty, Search};
use crate::linear::{Cholesky, Square, dot};
use crate::linear_problem::{BlockSums, LinearProblem, MIN_INDEPENDENT_SHARE, sum_blocks};
use crate::score::{distance, freedom, step_without_block};
use crate::statistics::hotelling_tail;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Number of candidates in each step whose cross-validated error is computed: those with the largest gains on
/// all data.
const MAX_EVALUATED: usize = 6;
/// Number of forward steps that may bring no improvement. Two effects that are both needed may each be
/// useless alone.
const MAX_IDLE_STEPS: usize = 2;
/// Maximum number of effects in a set of the linear problem.
pub(crate) const MAX_EFFECTS: usize = 5;
/// Maximum number of effects in a set of the linear problem that depend on the past. Their states have free initial values
/// in every window, so that three of them fit any smooth residuals, and such a fit takes longer than most others together.
pub(crate) const MAX_MEMORY_EFFECTS: usize = 2;

/// A set of column groups (effects) in the linear problem, with its value.
#[derive(Clone, Debug)]
pub(crate) struct LinearSet {
    /// Indices of the groups of columns in the set, in ascending order.
    pub groups: Vec<usize>,
    /// Gain over the declared model minus penalty, nats.
    pub value: f64,
    /// Coefficients of the declared columns, then of the groups' columns, in order.
    pub coefficients: Vec<f64>,
}

/// A forward, backward and exchange selection of effects in the linear problem.
struct Selection<'p> {
    problem: &'p LinearProblem,
    blocks: &'p [BlockSums],
    h: Square,
    g: Vec<f64>,
    penalty: Penalty,
    /// Log squared prediction error of the declared model on left-out blocks.
    base: f64,
    /// Whether a group with this index may be added.
    is_allowed: &'p dyn Fn(usize) -> bool,
}

/// All sets of effects that the selection evaluates, best first, including the fitted set.
pub(crate) fn select(problem: &LinearProblem, penalty: Penalty) -> Vec<LinearSet> {
    select_among(problem, penalty, &|_| true)
}

/// As [`select`], but only groups for which `is_allowed` holds are added.
pub(crate) fn select_among(
    problem: &LinearProblem,
    penalty: Penalty,
    is_allowed: &dyn Fn(usize) -> bool,
) -> Vec<LinearSet> {
    let selection = Selection { is_allowed, ..Selection::new(problem, &problem.blocks, penalty) };
    let mut visited = BTreeMap::new();
    selection.walk(&problem.fitted, &mut visited);
    if !problem.fitted.is_empty() {
        selection.walk(&[], &mut visited);
    }
    let mut sets: Vec<LinearSet> = visited.into_values().flatten().collect();
    sets.sort_by(|a, b| b.value.total_cmp(&a.value).then(a.groups.cmp(&b.groups)));
    sets
}

/// The best set of effects for given residuals, with the sums of products of these residuals.
pub(crate) struct Selected {
    pub chosen: LinearSet,
    blocks: Vec<BlockSums>,
}

/// Selects the best set of effects for the sums of products `blocks`.
pub(crate) fn select_for(problem: &LinearProblem, blocks: Vec<BlockSums>, penalty: Penalty) -> Selected {
    let chosen = best_of(&Selection::new(problem, &blocks, penalty));
    Selected { chosen, blocks }
}

/// Whether every group of a selected set is significant at the level of its addition. Values by group count as
/// significant: they have too many coefficients for their scatter over blocks, and their gain exceeds its penalty.
pub(crate) fn is_significant(problem: &LinearProblem, set: &Selected, search: &Search<'_>) -> bool {
    let groups = &set.chosen.groups;
    let is_significant = |(p, g): (&f64, &usize)| {
        let addition = &problem.groups[*g].addition;
        addition.has_values_by_group() || *p <= search.level(addition)
    };
    p_values(problem, &set.blocks, groups).iter().zip(groups).all(is_significant)
}

/// p-value of the coefficients of each group of a set, by their leave-one-out scatter over blocks.
pub(crate) fn p_values(problem: &LinearProblem, blocks: &[BlockSums], groups: &[usize]) -> Vec<f64> {
    let columns = problem.columns_of(groups);
    let sums: Vec<BlockSums> = blocks.iter().map(|b| b.sub(&columns)).collect();
    let BlockSums { h, g: mut x, .. } = sum_blocks(&sums);
    h.cholesky().solve(&mut x);
    let distances_from_nulls = problem.distances_from_nulls(&x);
    let leave_out = |block: &BlockSums| {
        let at_x = block.at_coefficients(&x);
        step_without_block(&h, &at_x.h, &at_x.g, &distances_from_nulls)
    };
    let moves: Vec<Vec<f64>> = sums.iter().map(leave_out).collect();
    let mut first = problem.declared.len();
    let p_values = groups.iter().map(|group| {
        let entries: Vec<usize> = (first..first + problem.groups[*group].columns.len()).collect();
        first += entries.len();
        let off: Vec<f64> = entries.iter().map(|&i| x[i]).collect();
        let freedom = freedom(&h, sums.iter().map(|block| &block.h), &entries);
        hotelling_tail(distance(&moves, &entries, &off, 0), entries.len(), freedom)
    });
    p_values.collect()
}

/// p-value of each group that is compatible with a set, when it is added to the set. Values by group have none: the
/// test of the differences between records is made for them.
pub(crate) fn p_values_given(problem: &LinearProblem, set: &[usize]) -> Vec<f64> {
    p_values_beside(problem, set, &|_| true).into_iter().map(|(_, p)| p).collect()
}

/// Index and p-value of each group that `is_tested` and is compatible with a set, when it is added to the set.
pub(crate) fn p_values_beside(
    problem: &LinearProblem,
    set: &[usize],
    is_tested: &dyn Fn(usize) -> bool,
) -> Vec<(usize, f64)> {
    let p_value = |g: usize| {
        let with = [set, &[g]].concat();
        (g, p_values_of(problem, &with).pop().unwrap_or(1.0))
    };
    let has_one_value = |g: &usize| !problem.groups[*g].addition.has_values_by_group();
    let groups = problem.compatible_groups(set).into_iter();
    let tested: Vec<usize> = groups.filter(|g| is_tested(*g)).filter(has_one_value).collect();
    tested.into_par_iter().map(p_value).collect()
}

/// p-value of the coefficients of each group of a set, with the residuals of the linear problem.
pub(crate) fn p_values_of(problem: &LinearProblem, groups: &[usize]) -> Vec<f64> {
    p_values(problem, &problem.blocks, groups)
}

/// The best set that a selection starting from no effects finds; the empty set if none is better.
fn best_of(selection: &Selection<'_>) -> LinearSet {
    let mut visited = BTreeMap::new();
    selection.walk(&[], &mut visited);
    let sets = visited.into_values().flatten();
    let none = LinearSet { groups: Vec::new(), value: 0.0, coefficients: Vec::new() };
    sets.fold(none, |best, one| if one.value > best.value { one } else { best })
}

/// Evaluated sets, by the indices of their groups; `None` for invalid sets.
type Passed = BTreeMap<Vec<usize>, Option<LinearSet>>;

impl<'p> Selection<'p> {
    fn new(problem: &'p LinearProblem, blocks: &'p [BlockSums], penalty: Penalty) -> Self {
        let BlockSums { h, g, .. } = sum_blocks(blocks);
        let mut new = Self { problem, blocks, h, g, penalty, base: 0.0, is_allowed: &|_| true };
        new.base = new.error(&problem.declared).0;
        new
    }

    /// Improves the set `from` forward, backward and by exchange, until nothing is better.
    fn walk(&self, from: &[usize], visited: &mut Passed) {
        let Some(mut best) = self.evaluate(from.to_vec(), visited) else { return };
        loop {
            let before = best.value;
            best = self.forward(best, visited);
            best = self.backward(best, visited);
            best = self.exchange(best, visited);
            if best.value <= before {
                return;
            }
        }
    }

    /// Adds groups one by one, continuing over a few steps without improvement; returns the best set.
    fn forward(&self, from: LinearSet, visited: &mut Passed) -> LinearSet {
        let (mut best, mut current, mut idle) = (from.clone(), from, 0);
        while idle < MAX_IDLE_STEPS && current.groups.len() < MAX_EFFECTS {
            let larger = self.strongest(&current.groups, MAX_EVALUATED, visited);
            let Some(next) = larger.into_iter().max_by(|a, b| a.value.total_cmp(&b.value)) else { break };
            current = next;
            if current.value > best.value {
                best = current.clone();
                idle = 0;
            } else {
                idle += 1;
            }
        }
        best
    }

    /// Drops groups one by one while that improves the set.
    fn backward(&self, from: LinearSet, visited: &mut Passed) -> LinearSet {
        let mut best = from;
        loop {
            let smaller = (0..best.groups.len()).filter_map(|k| {
                let mut remaining = best.groups.clone();
                remaining.remove(k);
                self.evaluate(remaining, visited)
            });
            match smaller.max_by(|a, b| a.value.total_cmp(&b.value)) {
                Some(smaller) if smaller.value > best.value => best = smaller,
                _ => return best,
            }
        }
    }

    /// Replaces single groups by others where that improves the set.
    fn exchange(&self, from: LinearSet, visited: &mut Passed) -> LinearSet {
        let mut best = from.clone();
        for k in 0..from.groups.len() {
            let mut remaining = from.groups.clone();
            remaining.remove(k);
            for other in self.strongest(&remaining, MAX_EVALUATED, visited) {
                if other.value > best.value {
                    best = other;
                }
            }
        }
        best
    }

    /// The sets with one more group that gain most on all data, at most `most` of them, evaluated.
    fn strongest(&self, groups: &[usize], most: usize, visited: &mut Passed) -> Vec<LinearSet> {
        let mut gains = self.gains(groups);
        gains.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        // Grid points of one addition are one candidate: only its best point is evaluated.
        let mut labels: Vec<String> = Vec::new();
        gains.retain(|(_, g)| {
            let label = self.problem.groups[*g].addition.label();
            let is_new = !labels.contains(&label);
            labels.push(label);
            is_new
        });
        let add = |(_, g): &(f64, usize)| {
            let mut set = groups.to_vec();
            set.push(*g);
            set.sort_unstable();
            self.evaluate(set, visited)
        };
        gains.iter().take(most).filter_map(add).collect()
    }

    /// Gain on all data of each group that can be added to the set `groups`.
    fn gains(&self, groups: &[usize]) -> Vec<(f64, usize)> {
        let columns = self.problem.columns_of(groups);
        let factor = self.h.sub(&columns).cholesky();
        let mut projected: Vec<f64> = columns.iter().map(|&c| self.g[c]).collect();
        factor.forward(&mut projected);
        let depends_on_past = |g: &usize| self.problem.groups[*g].addition.depends_on_past();
        let has_room = groups.iter().filter(|g| depends_on_past(g)).count() < MAX_MEMORY_EFFECTS;
        let can_join = |g: &usize| {
            let new = &self.problem.groups[*g];
            (self.is_allowed)(*g)
                && (has_room || !depends_on_past(g))
                && groups
                    .iter()
                    .all(|other| other != g && self.problem.groups[*other].is_compatible_with(new))
        };
        let gain = |g: usize| Some((self.gain_of(g, &columns, &factor, &projected)?, g));
        (0..self.problem.groups.len()).filter(can_join).filter_map(gain).collect()
    }

    /// Gain on all data of group `g` beside `columns`, whose Cholesky factor and projected gradient are
    /// given. `None` where the group is collinear with them or its coefficients are infeasible.
    fn gain_of(&self, g: usize, columns: &[usize], factor: &Cholesky, projected: &[f64]) -> Option<f64> {
        let group = &self.problem.groups[g];
        let candidate: Vec<usize> = group.columns.clone().collect();
        let shared: Vec<Vec<f64>> = candidate
            .iter()
            .map(|&c| {
                let mut x: Vec<f64> = columns.iter().map(|&d| self.h.at(c, d)).collect();
                factor.forward(&mut x);
                x
            })
            .collect();
        let mut s = Square::zero(candidate.len());
        for (i, &c) in candidate.iter().enumerate() {
            (0..candidate.len())
                .for_each(|j| *s.at_mut(i, j) = self.h.at(c, candidate[j]) - dot(&shared[i], &shared[j]));
        }
        let independent: Vec<usize> = (0..candidate.len())
            .filter(|&i| s.at(i, i) > MIN_INDEPENDENT_SHARE * self.h.at(candidate[i], candidate[i]))
            .collect();
        if independent.is_empty() {
            return None;
        }
        let mut u: Vec<f64> =
            independent.iter().map(|&i| self.g[candidate[i]] - dot(&shared[i], projected)).collect();
        let factor = s.sub(&independent).cholesky();
        let mut step = u.clone();
        factor.solve(&mut step);
        let mut coefficients = vec![0.0; candidate.len()];
        independent.iter().zip(&step).for_each(|(&i, d)| coefficients[i] = *d);
        factor.forward(&mut u);
        group.is_feasible(&coefficients).then(|| u.iter().map(|x| x * x).sum())
    }

    /// Evaluates a set, once. `None` where a column is collinear with others, or a coefficient is infeasible.
    fn evaluate(&self, groups: Vec<usize>, visited: &mut Passed) -> Option<LinearSet> {
        if let Some(evaluated) = visited.get(&groups) {
            return evaluated.clone();
        }
        let chosen = self.score_set(groups.clone());
        visited.insert(groups, chosen.clone());
        chosen
    }

    /// Computes gain minus penalty of a set, and its coefficients; `None` if a coefficient is infeasible.
    fn score_set(&self, groups: Vec<usize>) -> Option<LinearSet> {
        let columns = self.problem.columns_of(&groups);
        let (error, coefficients) = self.error(&columns);
        let mut next = self.problem.declared.len();
        for g in &groups {
            let group = &self.problem.groups[*g];
            let of_group = &coefficients[next..next + group.columns.len()];
            next += of_group.len();
            if !group.is_feasible(of_group) {
                return None;
            }
        }
        let gain = self.problem.half_independent_samples() * (self.base - error);
        let penalty = |g: &usize| self.penalty.of_addition(&self.problem.groups[*g].addition);
        let value = gain - groups.iter().map(penalty).sum::<f64>();
        value.is_finite().then_some(LinearSet { groups, value, coefficients })
    }

    /// Log squared prediction error on left-out blocks of a model with some columns, and their coefficients
    /// on all data.
    fn error(&self, columns: &[usize]) -> (f64, Vec<f64>) {
        let h = self.h.sub(columns);
        let mut x: Vec<f64> = columns.iter().map(|&c| self.g[c]).collect();
        h.cholesky().solve(&mut x);
        let distances_from_nulls = self.problem.distances_from_nulls(&x);
        let error_of = |block: &BlockSums| {
            let at_x = block.sub(columns).at_coefficients(&x);
            at_x.c
                - at_x
                    .h
                    .cost_decrease(&at_x.g, &step_without_block(&h, &at_x.h, &at_x.g, &distances_from_nulls))
        };
        let sum: f64 = self.blocks.iter().map(error_of).sum();
        (sum.max(f64::MIN_POSITIVE).ln(), x)
    }
}
