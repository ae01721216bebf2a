//! Clusters: parts of the data whose errors are independent, and the scatter of the parameters over them.
//!
//! Every window has its own initial state. Process noise therefore correlates the residuals of one window
//! over its whole length, and leaves different windows independent. Blocks cut windows, so their gradients
//! are correlated; clusters are groups of whole windows. With the robust cost `C(q)`, `q = r'r`, of `m`
//! degrees of freedom, the weight `w` of a window falls as its residuals grow:
//!
//! ```text
//! (5) curvature of the cost of a window       w J'J - 2/(8 + m) w^2 gg'     g = J'r
//! ```
//!
//! The second term is what process noise makes large. Without it the parameters seem to follow a window less
//! than they do, and intervals are too narrow.

use super::blocks::Blocks;
use super::evidence::{Cell, Scale};
use super::jackknife::{covariance, distance, freedom, step_without_block};
use crate::evaluate::softening;
use crate::interval::Quadratic;
use crate::linear::Square;
use std::collections::BTreeSet;

/// Neighbouring clusters to each side whose leave-one-out steps are taken as correlated where clusters are
/// adjacent. Windows longer than this number of blocks are cut, since too few clusters would be left.
pub(super) const NEIGHBOUR_LAGS: usize = 2;

/// The clusters of a fit.
#[derive(Clone, Debug)]
pub(crate) struct Clusters {
    /// Curvature (5) and gradient of the cost of each cluster.
    pub parts: Vec<Quadratic>,
    /// Neighbours to each side that may be correlated.
    pub lags: usize,
    /// Entries of theta that are not at a bound.
    free: Vec<usize>,
    /// Curvatures of the free entries, with constant weights.
    curvatures: Vec<Square>,
    /// Steps of theta when a cluster is left out.
    pub(super) moves: Vec<Vec<f64>>,
}

impl Clusters {
    /// Clusters of cells in blocks; `off` is the distance of each entry of theta from its null.
    pub(super) fn new(
        cells: &[Cell],
        scales: &[Scale],
        blocks: &Blocks,
        free: &[usize],
        off: &[f64],
    ) -> Self {
        let homes = homes(cells, scales.len());
        let count = homes.iter().collect::<BTreeSet<_>>().len();
        let are_whole = count * NEIGHBOUR_LAGS >= blocks.count;
        let cluster = |cell: &Cell| if are_whole { homes[cell.window] } else { cell.block };
        let gradients = gradients(cells, scales.len(), off.len());
        let empty = || (Square::zero(off.len()), Square::zero(off.len()), vec![0.0; off.len()]);
        let mut sums: Vec<Option<_>> = (0..blocks.count).map(|_| None).collect();
        for cell in cells {
            let sum = sums[cluster(cell)].get_or_insert_with(empty);
            add(sum, cell, &scales[cell.window], &gradients[cell.window]);
        }
        let sums: Vec<(Square, Square, Vec<f64>)> = sums.into_iter().flatten().collect();
        let curvatures: Vec<Square> = sums.iter().map(|s| s.0.sub(free)).collect();
        let parts: Vec<Quadratic> =
            sums.into_iter().map(|(_, curvature, gradient)| (curvature, gradient)).collect();
        let moves = moves(&curvatures, &parts, free, off);
        let lags = if blocks.are_adjacent { NEIGHBOUR_LAGS } else { 0 };
        Self { parts, lags, free: free.to_vec(), curvatures, moves }
    }

    /// Squared distance of the parameters `entries` from values that they are `off` by, in their covariance
    /// over clusters. Where clusters are adjacent, the covariance with neighbours (Newey and West 1987) is
    /// computed as well and the smaller distance is returned.
    pub fn distance(&self, entries: &[usize], off: &[f64]) -> f64 {
        let with_lags = |lags: usize| distance(&self.moves, entries, off, lags);
        with_lags(0).min(with_lags(self.lags))
    }

    /// Variance of a parameter; of the two covariances in [`distance`](Self::distance) the larger.
    pub fn variance(&self, entry: usize) -> f64 {
        let with_lags = |lags: usize| covariance(&self.moves, &[entry], lags).at(0, 0);
        with_lags(0).max(with_lags(self.lags))
    }

    /// Degrees of freedom of the covariance of the parameters `entries`, which are free.
    pub fn freedom(&self, entries: &[usize]) -> f64 {
        let positions: Vec<usize> =
            entries.iter().filter_map(|entry| self.free.iter().position(|i| i == entry)).collect();
        freedom(&sum(self.curvatures.iter(), self.free.len()), self.curvatures.iter(), &positions)
    }
}

/// The block in the middle of each window.
fn homes(cells: &[Cell], windows: usize) -> Vec<usize> {
    let mut ends = vec![(usize::MAX, 0); windows];
    for cell in cells.iter().filter(|cell| !cell.is_prior) {
        let (first, last) = &mut ends[cell.window];
        (*first, *last) = ((*first).min(cell.block), (*last).max(cell.block));
    }
    ends.into_iter().map(|(first, last)| first.min(last).midpoint(last)).collect()
}

/// `J'r` of the measured rows of each window.
fn gradients(cells: &[Cell], windows: usize, entries: usize) -> Vec<Vec<f64>> {
    let mut gradients = vec![vec![0.0; entries]; windows];
    for cell in cells.iter().filter(|cell| !cell.is_prior) {
        gradients[cell.window].iter_mut().zip(&cell.g).for_each(|(sum, g)| *sum += g);
    }
    gradients
}

/// Adds a cell to the curvature with constant weights, the curvature (5) and the gradient of its cluster.
/// `gradient` is that of the whole window; a cut window divides `gg'` among its cells.
fn add(sum: &mut (Square, Square, Vec<f64>), cell: &Cell, scale: &Scale, gradient: &[f64]) {
    let weight = if cell.is_prior { 1.0 } else { scale.weight };
    let softening = if cell.is_prior { 0.0 } else { softening(scale.degrees_of_freedom) };
    let (plain, curvature, total) = sum;
    for i in 0..gradient.len() {
        total[i] += weight * cell.g[i];
        for j in 0..gradient.len() {
            let product = 0.5 * (cell.g[i] * gradient[j] + gradient[i] * cell.g[j]);
            *plain.at_mut(i, j) += weight * cell.h.at(i, j);
            *curvature.at_mut(i, j) += weight * cell.h.at(i, j) - softening * weight * weight * product;
        }
    }
}

/// Steps of all entries of theta when a cluster is left out. Where the cost of the others has no minimum by
/// the curvature (5), the weights are taken as constant.
fn moves(plain: &[Square], parts: &[Quadratic], free: &[usize], off: &[f64]) -> Vec<Vec<f64>> {
    let from_null: Vec<f64> = free.iter().map(|&i| off[i]).collect();
    let curved: Vec<Square> = parts.iter().map(|(h, _)| h.sub(free)).collect();
    let (all_plain, all_curved) = (sum(plain.iter(), free.len()), sum(curved.iter(), free.len()));
    let step = |number: usize| {
        let gradient: Vec<f64> = free.iter().map(|&i| parts[number].1[i]).collect();
        let has_minimum = minus(&all_curved, &curved[number]).cholesky().is_definite();
        let (all, own) =
            if has_minimum { (&all_curved, &curved[number]) } else { (&all_plain, &plain[number]) };
        let mut step = vec![0.0; off.len()];
        free.iter().zip(step_without_block(all, own, &gradient, &from_null)).for_each(|(&i, d)| step[i] = d);
        step
    };
    (0..parts.len()).map(step).collect()
}

/// Difference of two matrices of equal size.
fn minus(from: &Square, by: &Square) -> Square {
    Square { n: from.n, a: from.a.iter().zip(&by.a).map(|(x, y)| x - y).collect() }
}

/// Sum of matrices of size `n`.
pub(super) fn sum<'a>(all: impl Iterator<Item = &'a Square>, n: usize) -> Square {
    let mut sum = Square::zero(n);
    all.for_each(|h| sum.a.iter_mut().zip(&h.a).for_each(|(a, x)| *a += x));
    sum
}

#[cfg(test)]
mod tests {
    //! Contract: intervals cover where windows are cut by blocks and have errors of their own, as under
    //! process noise. 600 repetitions of two parameters give a standard error of 0.6 %.
    use super::*;
    use crate::interval::Intervals;
    use crate::linear_toy::{Toy, ToyFit};
    use crate::score::{Evidence, Rows};

    const REPETITIONS: u64 = 600;

    /// Clusters of a toy with its windows in a row, cut into `blocks` blocks.
    fn clusters(toy: &Toy, fit: &ToyFit, blocks: usize) -> Clusters {
        let rows = Rows::of_linear_windows(&toy.rows(&fit.theta, blocks));
        let mut partition = Blocks::without_samples(blocks);
        partition.are_adjacent = true;
        Evidence::new(&rows, &partition, &[false; 2], &[0.0; 2]).clusters
    }

    /// Share of the intervals of two parameters that contain the truth, 0.
    fn coverage(windows: usize, misfit: f64, blocks: usize) -> f64 {
        let inside = (0..REPETITIONS).map(|seed| {
            let toy = Toy::draw(windows, seed, misfit, 2);
            let fit = toy.fit(2);
            let intervals = Intervals::new(&fit.information, &clusters(&toy, &fit, blocks));
            let halves = [intervals.half_width(&[1.0, 0.0]), intervals.half_width(&[0.0, 1.0])];
            (0..2).filter(|&i| fit.theta[i].abs() < halves[i]).count()
        });
        inside.sum::<usize>() as f64 / (2 * REPETITIONS) as f64
    }

    #[test]
    fn intervals_cover_where_blocks_cut_windows() {
        for (windows, misfit) in [(12, 0.0), (12, 2.0), (12, 6.0), (24, 6.0), (40, 6.0)] {
            let share = coverage(windows, misfit, 16);
            assert!((0.92..0.99).contains(&share), "{windows} windows, misfit {misfit}: {share}");
        }
    }

    #[test]
    fn windows_of_up_to_two_blocks_are_whole() {
        // Limits of one block or four would fail.
        let count = |windows: usize| {
            let toy = Toy::draw(windows, 1, 2.0, 2);
            clusters(&toy, &toy.fit(2), 16).parts.len()
        };
        assert_eq!([count(6), count(8), count(12), count(40)], [16, 8, 12, 16]);
    }
}
