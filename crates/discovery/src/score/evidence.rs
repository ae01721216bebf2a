//! Evidence: the information of each block on the parameters of a fit, and what follows from it without
//! another fit.
//!
//! For block `b` with residuals `r` and sensitivities `J` (nuisances projected out, windows weighted):
//!
//! ```text
//! H_b = J'J   g_b = J'r   H = sum H_b
//! (1) without block b the parameters move by  d_b = -(H - H_b)^-1 g_b
//! (2) its squared prediction error is         r'r - 2 d_b'g_b + d_b'H_b d_b
//! (3) covariance of the parameters            (B - 1)/B sum (d_b - mean)(d_b - mean)'
//! ```
//!
//! (1) is one Gauss-Newton step (approximate leave-one-out: Beirami et al. 2017; Giordano et al. 2019), (3)
//! the block jackknife (Kuensch 1989).

use super::blocks::Blocks;
use super::cells::{Cell, Scale, cells};
use super::clusters::{Clusters, NEIGHBOUR_LAGS};
use super::independence::Independence;
use super::jackknife::{covariance, distance, freedom, step_without_block};
use super::rows::{Rows, WindowRows};
use crate::evaluate::cost_and_weight;
use crate::linear::Square;
use crate::statistics::{f_tail, t_of_mean};
use rayon::prelude::*;

/// Minimum number of independent residuals in a block, where windows extend over several blocks. With a
/// correlation time of T samples one residual in 2 T is independent, and blocks of L samples understate a
/// variance by the share T/L for the correlation of neighbours (Kuensch 1989), two thirds of which the
/// weighted covariance of neighbours restores. With 7, one part in 42 is missing, which less than halves the
/// p-value of five standard errors.
const MIN_INDEPENDENT_PER_BLOCK: f64 = 7.0;

/// Information of each block of the data on the parameters of a fit, and predictions without each block.
#[derive(Clone, Debug)]
pub(crate) struct Evidence {
    pub blocks: usize,
    /// Whether blocks are adjacent segments of recordings, rather than groups of whole recordings.
    are_adjacent: bool,
    cells: Vec<Cell>,
    scales: Vec<Scale>,
    /// Indices of the entries of theta (the shared parameters) that are not at a bound.
    free: Vec<usize>,
    /// Curvature `H_b` of each block in the entries of theta (the shared parameters) that are not at a bound.
    curvatures: Vec<Square>,
    /// Steps of theta (the shared parameters) when each block is left out, formula (1), `[block][entry]`;
    /// entries at a bound do not move.
    pub moves: Vec<Vec<f64>>,
    /// Squared prediction error, formula (2), of each cell (the part of a window in a block), by the
    /// parameters fitted without its block.
    predicted: Vec<f64>,
    /// Minus twice the log predictive density of the left-out blocks.
    pub cost: f64,
    /// Autocorrelation of the residuals, as the share of them that is independent.
    pub independence: Independence,
}

impl Evidence {
    /// Computes the information of each block and its predictions from the rows of a fit. Entries of theta
    /// (the shared parameters) in `held` (at a bound) do not move; `off` is the distance of each entry from
    /// its null value.
    pub fn new(rows: &Rows, partition: &Blocks, held: &[bool], off: &[f64]) -> Self {
        let (blocks, are_adjacent) = (partition.count, partition.are_adjacent);
        let cells: Vec<Cell> = rows
            .windows
            .par_iter()
            .enumerate()
            .flat_map_iter(|(w, window)| cells(w, window, rows.width))
            .collect();
        let scale = |w: &WindowRows| Scale {
            weight: w.weight,
            degrees_of_freedom: w.degrees_of_freedom,
            is_tolerance: w.is_tolerance,
            constant: w.constant,
        };
        let scales: Vec<Scale> = rows.windows.iter().map(scale).collect();
        let free: Vec<usize> = (0..held.len()).filter(|i| !held[*i]).collect();
        let (curvatures, gradients) = by_block(&cells, &scales, blocks, &free);
        let moves = moves(&curvatures, &gradients, &free, off);
        let after = |cell: &Cell| cell.c - cell.h.cost_decrease(&cell.g, &moves[cell.block]);
        let predicted = cells.iter().map(after).collect();
        let mut found = Self {
            blocks,
            are_adjacent,
            cells,
            scales,
            free,
            curvatures,
            moves,
            predicted,
            cost: 0.0,
            independence: Independence::from_rows(rows),
        };
        let (squares, priors) = found.squares();
        let cost = |(w, scale): (usize, &Scale)| {
            let residual_cost = cost_and_weight(squares[w], scale.degrees_of_freedom, scale.is_tolerance).0;
            residual_cost + priors[w] + scale.constant
        };
        found.cost = found.scales.iter().enumerate().map(cost).sum();
        found
    }

    /// Squared prediction error of each window, and that of its priors.
    fn squares(&self) -> (Vec<f64>, Vec<f64>) {
        let mut squares = vec![0.0; self.scales.len()];
        let mut priors = vec![0.0; self.scales.len()];
        for (cell, predicted) in self.cells.iter().zip(&self.predicted) {
            let to = if cell.is_prior { &mut priors } else { &mut squares };
            to[cell.window] += predicted;
        }
        (squares, priors)
    }

    /// Gain in log predictive density over the model of `other`, on the same windows, by block, nats. Only
    /// independent residuals count. The decrease of a window's cost is divided among blocks in proportion to
    /// the decrease of their squared errors.
    pub fn gains_over(&self, other: &Self) -> Vec<f64> {
        let (new_squares, old_squares) = (self.squares().0, other.squares().0);
        let slope = |w: usize| {
            let (a, b, scale) = (new_squares[w], old_squares[w], self.scales[w]);
            let cost = |q: f64| cost_and_weight(q, scale.degrees_of_freedom, scale.is_tolerance);
            let is_near = (a - b).abs() <= 1e-9 * (a.abs() + b.abs());
            if is_near { cost(a).1 } else { (cost(a).0 - cost(b).0) / (a - b) }
        };
        let slopes: Vec<f64> = (0..self.scales.len()).map(slope).collect();
        let mut gains = vec![0.0; self.blocks];
        for (sign, evidence) in [(0.5, other), (-0.5, self)] {
            let mut first = vec![None; evidence.scales.len()];
            for (cell, predicted) in evidence.cells.iter().zip(&evidence.predicted) {
                let slope = if cell.is_prior { 1.0 } else { slopes[cell.window] };
                gains[cell.block] += sign * self.independence.share * slope * predicted;
                first[cell.window].get_or_insert(cell.block);
            }
            for (scale, block) in evidence.scales.iter().zip(first) {
                block
                    .into_iter()
                    .for_each(|b: usize| gains[b] += sign * self.independence.share * scale.constant);
            }
        }
        gains
    }

    /// One-sided p-value of the gain over `other`, by Student's t test on the gains of the blocks.
    pub fn p_value_of_gain(&self, other: &Self) -> f64 {
        let gains = self.gains_over(other);
        let t = t_of_mean(&gains);
        if t > 0.0 { 0.5 * f_tail(t * t, 1.0, gains.len() as f64 - 1.0) } else { 1.0 }
    }

    /// Upper bound of the p-value of the gain over `other`, for any distribution of the gains. A likelihood
    /// ratio of predictions exceeds `x` with probability at most `1/x` (Markov's inequality; Vovk and Wang
    /// 2021). The block with the largest gain is excluded, so that a single outlying record does not
    /// establish a random effect.
    pub fn p_value_bound(&self, other: &Self) -> f64 {
        let gains = self.gains_over(other);
        let largest = gains.iter().copied().fold(0.0, f64::max);
        (largest - gains.iter().sum::<f64>()).exp().min(1.0)
    }

    /// Standard error of the gain over the model of `other`, nats, from the scatter of the gains of the
    /// blocks.
    pub fn gain_standard_error(&self, other: &Self) -> f64 {
        let gains = self.gains_over(other);
        let n = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / n;
        (n / (n - 1.0) * gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>()).sqrt()
    }

    /// Squared distance of the parameters `entries` from values that they differ from by `off`, in their
    /// covariance (3). Where blocks are adjacent, the covariance with neighbours (Newey and West 1987) is
    /// computed as well and the smaller distance is returned.
    pub fn distance(&self, entries: &[usize], off: &[f64]) -> f64 {
        let with_lags = |lags: usize| distance(&self.moves, entries, off, lags);
        if self.are_adjacent { with_lags(0).min(with_lags(NEIGHBOUR_LAGS)) } else { with_lags(0) }
    }

    /// Whether blocks are not independent: windows extend over several blocks and residuals are strongly
    /// correlated. Windows within one block have their own initial states and share nothing.
    pub fn blocks_share_residuals(&self) -> bool {
        let spans_blocks = self.scales.len() < self.blocks;
        self.are_adjacent
            && spans_blocks
            && self.independence.share * self.independence.samples / (self.blocks as f64)
                < MIN_INDEPENDENT_PER_BLOCK
    }

    /// Effective degrees of freedom of the covariance (3) of the parameters `entries`, none of which is at a
    /// bound.
    pub fn freedom(&self, entries: &[usize]) -> f64 {
        let positions: Vec<usize> =
            entries.iter().filter_map(|entry| self.free.iter().position(|i| i == entry)).collect();
        freedom(&Square::sum(self.free.len(), &self.curvatures), self.curvatures.iter(), &positions)
    }

    /// Variance of the parameter with index `entry` in theta (the shared parameters). It is the larger one of
    /// the variances with and without neighbouring blocks, as in [`distance`](Self::distance).
    pub fn variance(&self, entry: usize) -> f64 {
        let with_lags = |lags: usize| covariance(&self.moves, &[entry], lags).at(0, 0);
        if self.are_adjacent { with_lags(0).max(with_lags(NEIGHBOUR_LAGS)) } else { with_lags(0) }
    }

    /// Divides the data into clusters, parts whose errors are independent.
    pub fn clusters(&self) -> Clusters {
        let entries = self.moves.first().map_or(0, Vec::len);
        Clusters::new(&self.cells, &self.scales, self.blocks, entries)
    }
}

/// Curvature `H_b` and gradient `g_b` of every block in the entries `free` of theta (the shared parameters).
fn by_block(cells: &[Cell], scales: &[Scale], blocks: usize, free: &[usize]) -> (Vec<Square>, Vec<Vec<f64>>) {
    let n = free.len();
    let (mut curvatures, mut gradients) = (vec![Square::zero(n); blocks], vec![vec![0.0; n]; blocks]);
    for cell in cells {
        let weight = if cell.is_prior { 1.0 } else { scales[cell.window].weight };
        let (h, g) = (&mut curvatures[cell.block], &mut gradients[cell.block]);
        h.add(weight, &cell.h.sub(free));
        g.iter_mut().zip(free).for_each(|(a, &i)| *a += weight * cell.g[i]);
    }
    (curvatures, gradients)
}

/// Steps of all entries of theta (the shared parameters) when each block is left out, formula (1).
fn moves(curvatures: &[Square], gradients: &[Vec<f64>], free: &[usize], off: &[f64]) -> Vec<Vec<f64>> {
    let sum = Square::sum(free.len(), curvatures);
    let from_null: Vec<f64> = free.iter().map(|&i| off[i]).collect();
    let without = |(h, g): (&Square, &Vec<f64>)| {
        let mut step = vec![0.0; off.len()];
        free.iter().zip(step_without_block(&sum, h, g, &from_null)).for_each(|(&i, d)| step[i] = d);
        step
    };
    curvatures.iter().zip(gradients).map(without).collect()
}

#[cfg(test)]
mod tests {
    //! Contract, on a linear model, where one Gauss-Newton step is exact: leave-one-out steps and
    //! predictions equal those of fits without the block, and the jackknife variance equals that over
    //! repetitions.
    use super::*;
    use crate::statistics::hotelling_tail;
    use augsim_data::random_stream;
    use rand_distr::{Distribution, StandardNormal};

    const BLOCKS: usize = 16;
    const ROWS: usize = 20;

    type Row = (Vec<f64>, f64, u16);

    /// Draws rows with noise of standard deviation 1 and true parameters 0. The residuals of each block share a
    /// random part of standard deviation `common`.
    fn draw(seed: u64, common: f64) -> Vec<Row> {
        let mut rng = random_stream(seed, "linear model", 0);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut rows = Vec::new();
        for block in 0..BLOCKS {
            let shared = common * normal();
            rows.extend(
                (0..ROWS).map(|_| (vec![1.0 + 0.3 * normal(), normal()], shared + normal(), block as u16)),
            );
        }
        rows
    }

    /// Least-squares estimate of the parameters from the rows of the blocks that `used` selects.
    fn fitted(rows: &[Row], used: impl Fn(u16) -> bool) -> Vec<f64> {
        let (mut h, mut g) = (Square::zero(2), vec![0.0; 2]);
        for (x, r, _) in rows.iter().filter(|row| used(row.2)) {
            for i in 0..2 {
                g[i] += x[i] * r;
                (0..2).for_each(|j| *h.at_mut(i, j) += x[i] * x[j]);
            }
        }
        h.cholesky().solve(&mut g);
        g
    }

    /// Evidence at the least-squares estimate from all rows.
    fn evidence(rows: &[Row]) -> Evidence {
        let theta = fitted(rows, |_| true);
        let left = |(x, r, b): &Row| (x.clone(), r - x[0] * theta[0] - x[1] * theta[1], *b);
        let rows: Vec<Row> = rows.iter().map(left).collect();
        Evidence::new(
            &Rows::of_linear_windows(&[rows], |_, _| 1.0),
            &Blocks::without_samples(BLOCKS),
            &[false; 2],
            &[0.0; 2],
        )
    }

    #[test]
    fn the_step_without_a_block_equals_a_fit_without_it() {
        let rows = draw(1, 0.5);
        let (found, all) = (evidence(&rows), fitted(&rows, |_| true));
        for block in 0..BLOCKS {
            let without = fitted(&rows, |b| usize::from(b) != block);
            (0..2).for_each(|i| assert!((found.moves[block][i] - (without[i] - all[i])).abs() < 1e-10));
            let block_rows = rows.iter().filter(|r| usize::from(r.2) == block);
            let error: f64 =
                block_rows.map(|(x, r, _)| (r - x[0] * without[0] - x[1] * without[1]).powi(2)).sum();
            let cell = found.cells.iter().position(|c| c.block == block).expect("a cell");
            assert!((found.predicted[cell] - error).abs() < 1e-8, "{} {error}", found.predicted[cell]);
        }
    }

    #[test]
    fn the_jackknife_variance_includes_correlation_within_blocks() {
        let repetitions = 300;
        let (mut squares, mut variances) = (0.0, 0.0);
        for seed in 0..repetitions {
            let rows = draw(seed, 0.5);
            squares += fitted(&rows, |_| true)[0].powi(2);
            variances += evidence(&rows).variance(0);
        }
        // Independent noise alone would give a sixth of it.
        let ratio = variances / squares;
        assert!((0.8..1.3).contains(&ratio), "{ratio}");
    }

    /// Share of draws without an effect in which the second column is significant at 1 %. In all blocks but four
    /// its values are divided by ten.
    fn false_findings(freedom: impl Fn(&Evidence) -> f64) -> f64 {
        let draws = 2000;
        let found = (0..draws).filter(|seed| {
            let mut rows = draw(*seed, 0.0);
            rows.iter_mut().filter(|r| r.2 >= 4).for_each(|r| r.0[1] *= 0.1);
            let (found, value) = (evidence(&rows), fitted(&rows, |_| true)[1]);
            hotelling_tail(found.distance(&[1], &[value]), 1, freedom(&found)) < 0.01
        });
        found.count() as f64 / draws as f64
    }

    #[test]
    fn effective_freedom_keeps_the_false_positive_rate_with_few_informative_blocks() {
        let (effective, nominal) =
            (false_findings(|e| e.freedom(&[1])), false_findings(|_| BLOCKS as f64 - 1.0));
        assert!(effective < 0.015 && nominal > 0.02, "{effective} {nominal}");
    }

    /// Whether one window over all blocks makes the blocks dependent, with `in_a_block` independent residuals in
    /// each block.
    fn shares(in_a_block: f64) -> bool {
        let mut found = evidence(&draw(1, 0.0));
        found.are_adjacent = true;
        found.independence.share = in_a_block / ROWS as f64;
        found.blocks_share_residuals()
    }

    #[test]
    fn a_window_may_span_blocks_only_with_short_correlation() {
        // A limit twice or half as large would fail.
        assert!(shares(5.0) && !shares(9.0));
    }

    #[test]
    fn autocorrelated_residuals_count_less() {
        let white = evidence(&draw(3, 0.0)).independence.share;
        let autocorrelated = evidence(&draw(3, 3.0)).independence.share;
        assert!(white > 0.95 && autocorrelated < 0.2, "{white} {autocorrelated}");
    }

    #[test]
    fn a_gain_in_a_single_block_is_not_significant() {
        let rows = draw(5, 0.0);
        let mut odd = rows.clone();
        odd.iter_mut().filter(|r| r.2 == 3).for_each(|r| r.1 += 30.0);
        let (plain, odd) = (evidence(&rows), evidence(&odd));
        assert!(plain.gains_over(&odd).iter().sum::<f64>() > 100.0);
        assert!(plain.p_value_of_gain(&odd) > 0.05);
    }
}
