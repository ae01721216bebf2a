//! Clusters: parts of the data whose errors are independent, for the intervals of the parameters.
//!
//! Every window has its own initial state. Process noise therefore correlates the residuals of one window
//! over its whole length, and leaves different windows independent. Blocks cut windows, so their gradients
//! are correlated; clusters are groups of whole windows. With the robust cost of `m` residuals, the weight
//! `w` of a window falls as its residuals grow:
//!
//! ```text
//! (7) curvature of the cost of a window       w J'J - 2/(8 + m) w^2 gg'     g = J'r
//! (8) curvature of the cost                   k H    k = 1 - mean over parameters of sum 2/(8 + m) w^2 g'H^-1 g
//! ```
//!
//! with `H` the sum of `w J'J`. The second term of (7) is small for white noise and large for autocorrelated
//! residuals, whose gradients are large. (8) has its mean over the parameters: with a dozen windows the sum
//! of (7) may be nearly singular by chance. Under process noise intervals from blocks, without the second
//! term, cover 84 % instead of 94 %.

use super::cells::{Cell, Scale};
use crate::evaluate::softening;
use crate::interval::Quadratic;
use crate::linear::{Square, dot};
use std::collections::BTreeSet;

/// Number of neighbouring blocks to each side whose leave-one-out steps are treated as correlated. Windows
/// longer than this number of blocks are cut into blocks, because too few clusters would be left.
pub(super) const NEIGHBOUR_LAGS: usize = 2;

/// Minimum of the factor `k` by which the robust cost reduces curvatures, formula (8). It is that of windows
/// with residuals worth three independent values, two of which determine the initial state of a system of
/// second order.
const MIN_CURVATURE_SHARE: f64 = 1.0 - 2.0 / 3.0;

/// Clusters of a fit: parts of the data whose errors are independent.
#[derive(Clone, Debug)]
pub(crate) struct Clusters {
    /// Curvature (8) and gradient of the cost of each cluster, in the entries of theta (the shared
    /// parameters).
    pub parts: Vec<Quadratic>,
    /// Number of neighbouring clusters to each side that may be correlated.
    pub lags: usize,
}

impl Clusters {
    /// Groups cells in `blocks` blocks into clusters, for `entries` entries of theta (the shared parameters).
    pub(super) fn new(cells: &[Cell], scales: &[Scale], blocks: usize, entries: usize) -> Self {
        let homes = homes(cells, scales.len());
        let count = homes.iter().collect::<BTreeSet<_>>().len();
        let are_whole = count * NEIGHBOUR_LAGS >= blocks;
        let mut parts: Vec<Option<Quadratic>> = vec![None; blocks];
        for cell in cells {
            let cluster = if are_whole { homes[cell.window] } else { cell.block };
            let (h, g) = parts[cluster].get_or_insert_with(|| (Square::zero(entries), vec![0.0; entries]));
            let weight = if cell.is_prior { 1.0 } else { scales[cell.window].weight };
            h.add(weight, &cell.h);
            g.iter_mut().zip(&cell.g).for_each(|(sum, x)| *sum += weight * x);
        }
        let mut parts: Vec<Quadratic> = parts.into_iter().flatten().collect();
        let share = curvature_share(&parts, cells, scales, entries);
        parts.iter_mut().flat_map(|(h, _)| &mut h.a).for_each(|x| *x *= share);
        let lags = if are_whole { 0 } else { NEIGHBOUR_LAGS };
        Self { parts, lags }
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

/// Gradient `J'r` of the measured rows of each window, `[window][shared parameter]`.
fn gradients(cells: &[Cell], windows: usize, entries: usize) -> Vec<Vec<f64>> {
    let mut gradients = vec![vec![0.0; entries]; windows];
    for cell in cells.iter().filter(|cell| !cell.is_prior) {
        gradients[cell.window].iter_mut().zip(&cell.g).for_each(|(sum, g)| *sum += g);
    }
    gradients
}

/// Factor `k` by which the robust cost reduces curvatures, formula (8), for clusters `parts` with constant
/// weights.
fn curvature_share(parts: &[Quadratic], cells: &[Cell], scales: &[Scale], entries: usize) -> f64 {
    let sum = Square::sum(entries, parts.iter().map(|(h, _)| h));
    let informed = (0..entries).filter(|&i| sum.at(i, i) > 0.0).count().max(1);
    let factor = sum.cholesky();
    let decrease = |(gradient, scale): (&Vec<f64>, &Scale)| {
        let mut step = gradient.clone();
        factor.solve(&mut step);
        softening(scale.degrees_of_freedom) * scale.weight * scale.weight * dot(gradient, &step)
    };
    let gradients = gradients(cells, scales.len(), entries);
    let decreases = gradients.iter().zip(scales).map(decrease);
    (1.0 - decreases.sum::<f64>() / informed as f64).max(MIN_CURVATURE_SHARE)
}

#[cfg(test)]
mod tests {
    //! Contract: intervals cover where windows are cut by blocks and have errors of their own, as under
    //! process noise. 600 repetitions of two parameters give a standard error of 0.6 %.
    use super::*;
    use crate::evaluate::cost_and_weight;
    use crate::interval::Intervals;
    use crate::linear_toy::{Toy, ToyFit};
    use crate::score::{Blocks, Evidence, Rows};

    const REPETITIONS: u64 = 600;

    /// Clusters of the linear test model, whose windows follow one another and are cut into `blocks` blocks.
    fn clusters(toy: &Toy, fit: &ToyFit, blocks: usize) -> Clusters {
        let rows =
            Rows::of_linear_windows(&toy.rows(&fit.theta, blocks), |q, m| cost_and_weight(q, m, false).1);
        Evidence::new(&rows, &Blocks::without_samples(blocks), &[false; 2], &[0.0; 2]).clusters()
    }

    /// Share of the 95 % intervals of two parameters that contain their true value, 0, over all repetitions.
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
    fn gradients_beyond_their_information_count_as_three_values() {
        let toy = Toy::draw(12, 1, 2.0, 2);
        let at = |share: f64| {
            let mut fit = toy.fit(2);
            fit.theta.iter_mut().for_each(|t| *t += share);
            let sum = |parts: &[Quadratic]| parts.iter().map(|(h, _)| h.at(0, 0)).sum::<f64>();
            let plain = sum(&toy.at(&fit.theta).windows);
            sum(&clusters(&toy, &fit, 16).parts) / plain
        };
        // At the minimum the share is between that of white noise and the minimum; far from it all gradients
        // are as large as their windows allow.
        assert!((0.5..1.0).contains(&at(0.0)), "{}", at(0.0));
        assert!((at(30.0) - 1.0 / 3.0).abs() < 1e-9, "{}", at(30.0));
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
