//! The predictions near a fit as a linear problem: columns for each candidate, and sums of their products by
//! block.
//!
//! Each column costs one simulation of the data. After that, the gain, the coefficients and the
//! cross-validated error of any set of candidates follow from the sums of products in microseconds.

use super::group::ColumnGroup;
use crate::addition::Addition;
use crate::linear::Square;

/// Minimum share of a column's sum of squares that must remain after projecting out the declared columns.
/// Less is rounding error.
pub(crate) const MIN_INDEPENDENT_SHARE: f64 = 1e-6;
/// Absolute cosine of the angle between two columns above which they are the same effect under two names.
const ALIAS_COSINE: f64 = 1.0 - 1e-9;

/// Sums of products over the rows of one block, for columns J and residuals r: `J'J`, `J'r` and `r'r`.
#[derive(Clone, Debug)]
pub(crate) struct BlockSums {
    pub h: Square,
    pub g: Vec<f64>,
    pub c: f64,
}

impl BlockSums {
    /// Restricts the sums to the columns with these indices.
    pub fn sub(&self, columns: &[usize]) -> Self {
        Self { h: self.h.sub(columns), g: columns.iter().map(|&c| self.g[c]).collect(), c: self.c }
    }

    /// Sums with the residuals that remain when the columns have the coefficients `x`.
    pub fn at_coefficients(&self, x: &[f64]) -> Self {
        let explained = |i: usize| x.iter().enumerate().map(|(j, x)| self.h.at(i, j) * x).sum::<f64>();
        let g = self.g.iter().enumerate().map(|(i, g)| g - explained(i)).collect();
        Self { h: self.h.clone(), g, c: self.c - self.h.cost_decrease(&self.g, x) }
    }

    /// Sums with the residuals multiplied by `sign`, which is 1 or -1.
    pub fn with_sign(&self, sign: f64) -> Self {
        Self { h: self.h.clone(), g: self.g.iter().map(|g| sign * g).collect(), c: self.c }
    }
}

/// Adds up the sums of products of all blocks.
pub(crate) fn sum_blocks(blocks: &[BlockSums]) -> BlockSums {
    let n = blocks.first().map_or(0, |b| b.g.len());
    let mut sum = BlockSums { h: Square::zero(n), g: vec![0.0; n], c: 0.0 };
    for block in blocks {
        sum.h.add(1.0, &block.h);
        sum.g.iter_mut().zip(&block.g).for_each(|(a, x)| *a += x);
        sum.c += block.c;
    }
    sum
}

/// Predictions near a fit as a linear problem, with columns for declared parameters and candidates.
#[derive(Debug)]
pub(crate) struct LinearProblem {
    /// Indices of the columns of the declared parameters that are not at a bound; every set contains them.
    pub declared: Vec<usize>,
    pub groups: Vec<ColumnGroup>,
    /// Indices of the groups of columns that represent the additions of the fitted set.
    pub fitted: Vec<usize>,
    pub blocks: Vec<BlockSums>,
    /// Number of residuals (measured samples) in all blocks.
    pub(crate) samples: f64,
    /// Share of the residuals that are independent.
    pub(crate) independent: f64,
    pub(crate) width: usize,
}

impl LinearProblem {
    /// Sums of products by block, with the residuals that remain after a least-squares fit of these columns.
    pub fn residual_sums(&self, columns: &[usize]) -> Vec<BlockSums> {
        let BlockSums { h, g: mut x, .. } = sum_blocks(&self.blocks).sub(columns);
        h.cholesky().solve(&mut x);
        let mut coefficients = vec![0.0; self.width];
        columns.iter().zip(x).for_each(|(&c, x)| coefficients[c] = x);
        self.blocks.iter().map(|block| block.at_coefficients(&coefficients)).collect()
    }

    /// Distances of coefficients from their null values. They are 0 for the declared parameters, which come
    /// first and have no null value.
    pub fn distances_from_nulls(&self, coefficients: &[f64]) -> Vec<f64> {
        let declared = self.declared.len();
        coefficients.iter().enumerate().map(|(k, x)| if k < declared { 0.0 } else { *x }).collect()
    }

    /// Half the number of independent residuals, which converts a difference of log squared errors to nats.
    pub fn half_independent_samples(&self) -> f64 {
        0.5 * self.samples * self.independent
    }

    /// Groups of columns that are compatible with those in `set` and not part of the fitted set.
    pub fn compatible_groups(&self, set: &[usize]) -> Vec<usize> {
        let is_compatible = |g: &usize| {
            let new = &self.groups[*g];
            !self.fitted.contains(g) && set.iter().all(|f| self.groups[*f].is_compatible_with(new))
        };
        (0..self.groups.len()).filter(is_compatible).collect()
    }

    /// Other starts of the periodic effect of group `group`: the further peaks of its periodogram.
    pub fn other_cycles(&self, group: usize) -> Vec<(Addition, Vec<f64>)> {
        let chosen = &self.groups[group];
        let is_other = |g: &&ColumnGroup| g.addition == chosen.addition && g.point != chosen.point;
        let is_periodic = chosen.addition.is_periodic();
        let others = self.groups.iter().filter(|_| is_periodic).filter(is_other);
        others.map(|g| (g.addition.clone(), g.point.clone())).collect()
    }

    /// Indices of the columns of the declared parameters and of the groups `groups`.
    pub fn columns_of(&self, groups: &[usize]) -> Vec<usize> {
        let of_groups = groups.iter().flat_map(|g| self.groups[*g].columns.clone());
        self.declared.iter().copied().chain(of_groups).collect()
    }
}

impl LinearProblem {
    /// Drops groups of one column that repeats an earlier one: the same effect under another name.
    pub(crate) fn drop_aliases(&mut self) {
        let sum = sum_blocks(&self.blocks);
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
                    !same && cosine.abs() > ALIAS_COSINE
                })
        };
        let aliases: Vec<usize> = single.iter().filter(|s| repeats(s)).map(|(g, _)| *g).collect();
        let mut number = 0;
        self.groups.retain(|_| {
            number += 1;
            !aliases.contains(&(number - 1))
        });
    }
}
