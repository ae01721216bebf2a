//! Evidence of each block on a fit's parameters, and what follows from it without another fit.
//!
//! Of block `b` with residuals `r` and sensitivities `J` (own unknowns projected out, windows weighted):
//!
//! ```text
//! H_b = J'J   g_b = J'r   H = sum H_b
//! (1) without block b the parameters move by  d_b = -(H - H_b)^-1 g_b
//! (2) its squared prediction error is         r'r - 2 d_b'g_b + d_b'H_b d_b
//! (3) covariance of the parameters            (B - 1)/B sum (d_b - mean)(d_b - mean)'
//! (4) share of the samples that are independent   1 / (1 + 2 sum_k (1 - k/L) rho_k^2)
//! ```
//!
//! (1) is one step of Gauss and Newton (approximate leave-one-out: Beirami et al. 2017; Giordano et al. 2019), (3) the block jackknife
//! (Kuensch 1989), (4) Bartlett's (1946) for squares of residuals with the autocorrelation `rho` within windows of `L` samples, less what
//! white noise shows.

use super::blocks::Blocks;
use super::jackknife::{covariance, distance, move_without};
use super::rows::{Rows, WindowRows};
use crate::evaluate::{cost_and_weight, softening};
use crate::linear::Square;
use crate::statistics::f_tail;
use augsim_linear::gram_of_rows;
use rayon::prelude::*;

/// Lags up to which residuals are correlated with themselves: a residual that lasts longer than a block is told by the blocks.
const MOST_LAGS: usize = 1000;

/// Neighbouring blocks whose moves are taken together, to each side.
const LAGS: usize = 2;

/// One block's part of one window.
#[derive(Clone, Debug)]
struct Cell {
    window: usize,
    block: usize,
    is_prior: bool,
    /// `J'J` of the part without the window's weight.
    h: Square,
    /// `J'r`.
    g: Vec<f64>,
    /// `r'r`.
    c: f64,
}

/// Parts of a window's cost.
#[derive(Clone, Copy, Debug)]
struct Scale {
    weight: f64,
    freedom: f64,
    tolerated: bool,
    constant: f64,
}

/// Evidence of the blocks on a fit.
#[derive(Clone, Debug)]
pub(crate) struct Evidence {
    pub blocks: usize,
    /// Whether blocks are stretches of recordings.
    touch: bool,
    cells: Vec<Cell>,
    scales: Vec<Scale>,
    /// How the parameters move when each block is left out; entries that are held do not move.
    pub moves: Vec<Vec<f64>>,
    /// Squared prediction error of each cell by parameters that did not see its block.
    predicted: Vec<f64>,
    cost: f64,
    /// Share of the residuals that are independent of each other, (4).
    pub independent: f64,
}

impl Evidence {
    /// Evidence of the rows of a fit; entries of theta that are `held` (at a bound) do not move.
    pub fn new(rows: &Rows, of: &Blocks, held: &[bool]) -> Self {
        let (blocks, touch) = (of.count, of.touch);
        let cells: Vec<Cell> = rows
            .windows
            .par_iter()
            .enumerate()
            .flat_map_iter(|(w, window)| cells(w, window, rows.width))
            .collect();
        let scale = |w: &WindowRows| Scale {
            weight: w.weight,
            freedom: w.freedom,
            tolerated: w.tolerated,
            constant: w.constant,
        };
        let scales: Vec<Scale> = rows.windows.iter().map(scale).collect();
        let moves = moves(&cells, &scales, blocks, held);
        let after = |cell: &Cell| cell.c - cell.h.fall(&cell.g, &moves[cell.block]);
        let predicted = cells.iter().map(after).collect();
        let independent = independent(rows);
        let mut found = Self { blocks, touch, cells, scales, moves, predicted, cost: 0.0, independent };
        let (squares, priors) = found.squares();
        let cost = |(w, scale): (usize, &Scale)| {
            let own = cost_and_weight(squares[w], scale.freedom, scale.tolerated).0;
            own + priors[w] + scale.constant
        };
        found.cost = found.scales.iter().enumerate().map(cost).sum();
        found
    }

    /// Squares of the predictions of each window, and of the priors of its own unknowns.
    fn squares(&self) -> (Vec<f64>, Vec<f64>) {
        let mut squares = vec![0.0; self.scales.len()];
        let mut priors = vec![0.0; self.scales.len()];
        for (cell, predicted) in self.cells.iter().zip(&self.predicted) {
            let to = if cell.is_prior { &mut priors } else { &mut squares };
            to[cell.window] += predicted;
        }
        (squares, priors)
    }

    /// Minus twice the logarithm of the likelihood of predictions that did not see their blocks.
    pub fn cost(&self) -> f64 {
        self.cost
    }

    /// Gain over other evidence on the same windows in each block, in nats as of independent samples: a block has the part of the fall of
    /// its windows' costs that its squares have in the fall of theirs.
    pub fn gains_over(&self, other: &Self) -> Vec<f64> {
        let (mine, theirs) = (self.squares().0, other.squares().0);
        let slope = |w: usize| {
            let (a, b, scale) = (mine[w], theirs[w], self.scales[w]);
            let cost = |q: f64| cost_and_weight(q, scale.freedom, scale.tolerated);
            let is_near = (a - b).abs() <= 1e-9 * (a.abs() + b.abs());
            if is_near { cost(a).1 } else { (cost(a).0 - cost(b).0) / (a - b) }
        };
        let slopes: Vec<f64> = (0..self.scales.len()).map(slope).collect();
        let mut gains = vec![0.0; self.blocks];
        for (sign, evidence) in [(0.5, other), (-0.5, self)] {
            let mut first = vec![None; evidence.scales.len()];
            for (cell, predicted) in evidence.cells.iter().zip(&evidence.predicted) {
                let slope = if cell.is_prior { 1.0 } else { slopes[cell.window] };
                gains[cell.block] += sign * self.independent * slope * predicted;
                first[cell.window].get_or_insert(cell.block);
            }
            for (scale, block) in evidence.scales.iter().zip(first) {
                block.into_iter().for_each(|b: usize| gains[b] += sign * self.independent * scale.constant);
            }
        }
        gains
    }

    /// Probability that chance alone gains as much over other evidence, by the gains of the blocks (Student's law, one-sided).
    pub fn chance_of_gain(&self, other: &Self) -> f64 {
        let gains = self.gains_over(other);
        let n = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / n;
        let variance = gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let t = mean / (variance / n).sqrt();
        if t > 0.0 { 0.5 * f_tail(t * t, 1.0, n - 1.0) } else { 1.0 }
    }

    /// Bound on the probability that chance alone gains as much over other evidence, whatever the law of the gains: a ratio of likelihoods of
    /// predictions exceeds `x` with a probability of at most `1/x` (Markov's inequality; Vovk and Wang 2021). The block that gains most is left
    /// out, so that one record which nothing follows makes no scatter.
    pub fn bound_on_chance(&self, other: &Self) -> f64 {
        let gains = self.gains_over(other);
        let most = gains.iter().copied().fold(0.0, f64::max);
        (most - gains.iter().sum::<f64>()).exp().min(1.0)
    }

    /// Standard error of the gain over other evidence, in nats, by the gains of the blocks.
    pub fn error_of_gain(&self, other: &Self) -> f64 {
        let gains = self.gains_over(other);
        let n = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / n;
        (n / (n - 1.0) * gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>()).sqrt()
    }

    /// Squared distance of some parameters from values that they are `off` by, in their covariance (3). Where blocks touch, their moves may
    /// go the same way: the covariance of neighbours together is taken as well (Newey and West 1987), and the lesser distance counts.
    pub fn distance(&self, entries: &[usize], off: &[f64]) -> f64 {
        let of = |lags: usize| distance(&self.moves, entries, off, lags);
        if self.touch { of(0).min(of(LAGS)) } else { of(0) }
    }

    /// Variance of a parameter as in [`distance`](Self::distance): the larger of both.
    pub fn variance(&self, entry: usize) -> f64 {
        let of = |lags: usize| covariance(&self.moves, &[entry], lags).at(0, 0);
        if self.touch { of(0).max(of(LAGS)) } else { of(0) }
    }

    /// Curvature and gradient of the cost of each block. Where a window lies in one block, the derivative of its weight is in the
    /// curvature: without it the sandwich covers 75 % under a smooth misfit of two standard deviations, with it 95 %.
    pub fn clusters(&self) -> Vec<(Square, Vec<f64>)> {
        let p = self.moves.first().map_or(0, Vec::len);
        let mut parts = vec![0; self.scales.len()];
        self.cells.iter().filter(|c| !c.is_prior).for_each(|c| parts[c.window] += 1);
        let mut all = vec![(Square::zero(p), vec![0.0; p]); self.blocks];
        for cell in &self.cells {
            let scale = &self.scales[cell.window];
            let weight = if cell.is_prior { 1.0 } else { scale.weight };
            let is_whole = !cell.is_prior && parts[cell.window] == 1;
            let softening = if is_whole { softening(scale.freedom) } else { 0.0 };
            let (h, g) = &mut all[cell.block];
            for (i, own) in g.iter_mut().enumerate() {
                *own += weight * cell.g[i];
                for j in 0..p {
                    let bent = softening * weight * weight * cell.g[i] * cell.g[j];
                    *h.at_mut(i, j) += weight * cell.h.at(i, j) - bent;
                }
            }
        }
        all
    }
}

/// The cells of a window: its rows by block, those of priors apart.
fn cells(w: usize, window: &WindowRows, width: usize) -> Vec<Cell> {
    let measured = window.places.len() - window.priors;
    let mut blocks: Vec<(u16, bool)> =
        window.places.iter().enumerate().map(|(k, p)| (p.0, k >= measured)).collect();
    blocks.sort_unstable();
    blocks.dedup();
    let p = width - 1;
    let of = |(block, is_prior): (u16, bool)| {
        let mine = window.places.iter().zip(window.values.chunks_exact(width)).enumerate();
        let rows: Vec<f64> = mine
            .filter(|(k, (place, _))| place.0 == block && (*k >= measured) == is_prior)
            .flat_map(|(_, (_, row))| row.iter().copied())
            .collect();
        let all = gram_of_rows(&rows, width);
        let mut h = Square::zero(p);
        (0..p).for_each(|i| (0..p).for_each(|j| *h.at_mut(i, j) = all[i * width + j]));
        let g = (0..p).map(|i| all[i * width + p]).collect();
        Cell { window: w, block: usize::from(block), is_prior, h, g, c: all[p * width + p] }
    };
    blocks.into_iter().map(of).collect()
}

/// (1) for every block.
fn moves(cells: &[Cell], scales: &[Scale], blocks: usize, held: &[bool]) -> Vec<Vec<f64>> {
    let p = held.len();
    let moving: Vec<usize> = (0..p).filter(|i| !held[*i]).collect();
    let mut each = vec![(Square::zero(p), vec![0.0; p]); blocks];
    for cell in cells {
        let weight = if cell.is_prior { 1.0 } else { scales[cell.window].weight };
        let (h, g) = &mut each[cell.block];
        h.a.iter_mut().zip(&cell.h.a).for_each(|(a, x)| *a += weight * x);
        g.iter_mut().zip(&cell.g).for_each(|(a, x)| *a += weight * x);
    }
    let mut sum = Square::zero(p);
    each.iter().for_each(|(h, _)| sum.a.iter_mut().zip(&h.a).for_each(|(a, x)| *a += x));
    let sum = sum.sub(&moving);
    let without = |(h, g): &(Square, Vec<f64>)| {
        let gradient: Vec<f64> = moving.iter().map(|&i| g[i]).collect();
        let step = move_without(&sum, &h.sub(&moving), &gradient);
        let mut all = vec![0.0; p];
        moving.iter().zip(step).for_each(|(&i, d)| all[i] = d);
        all
    };
    each.iter().map(without).collect()
}

/// (4), over all windows and channels.
fn independent(rows: &Rows) -> f64 {
    let width = rows.width;
    let (mut sums, mut counts) = (Vec::new(), Vec::new());
    let (mut samples, mut longest) = (0, 0);
    for window in &rows.windows {
        let measured = window.places.len() - window.priors;
        let residual = |k: usize| window.values[k * width + width - 1] * window.weight.sqrt();
        let mut first = 0;
        while first < measured {
            let channel = window.places[first].1;
            let end = (first..measured).find(|&k| window.places[k].1 != channel).unwrap_or(measured);
            let series: Vec<f64> = (first..end).map(residual).collect();
            let lags = (series.len() / 2).clamp(1, MOST_LAGS);
            if sums.len() < lags {
                sums.resize(lags, 0.0);
                counts.resize(lags, 0.0);
            }
            for lag in 0..lags {
                sums[lag] += series[lag..].iter().zip(&series).map(|(a, b)| a * b).sum::<f64>();
                counts[lag] += (series.len() - lag) as f64;
            }
            samples += series.len();
            longest = longest.max(series.len());
            first = end;
        }
    }
    let Some(power) = sums.first().zip(counts.first()).map(|(s, n): (&f64, &f64)| s / n) else { return 1.0 };
    if !(power > 0.0 && power.is_finite()) {
        return 1.0;
    }
    let excess = sums.iter().zip(&counts).enumerate().skip(1).map(|(_, (s, n))| {
        let rho = s / n / power;
        (n / samples as f64) * (rho * rho - 1.0 / n)
    });
    1.0 / (1.0 + 2.0 * excess.sum::<f64>().max(0.0))
}

#[cfg(test)]
mod tests {
    //! Contract, on a linear model, where one step of Gauss and Newton is exact: moves and predictions of left-out blocks are those of fits
    //! without them, and the jackknife's variance is that of the estimate over repetitions.
    use super::*;
    use augsim_data::random_stream;
    use rand_distr::{Distribution, StandardNormal};

    const BLOCKS: usize = 16;
    const ROWS: usize = 20;

    type Row = (Vec<f64>, f64, u16);

    /// Rows with noise of 1 and parameters 0, in blocks that share a part of their residual of standard deviation `common`.
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

    /// Least squares of the rows that are `used`.
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

    /// Evidence at the least squares of all rows.
    fn evidence(rows: &[Row]) -> Evidence {
        let theta = fitted(rows, |_| true);
        let left = |(x, r, b): &Row| (x.clone(), r - x[0] * theta[0] - x[1] * theta[1], *b);
        let rows: Vec<Row> = rows.iter().map(left).collect();
        Evidence::new(&Rows::of_linear_model(&rows), &Blocks::apart(BLOCKS), &[false; 2])
    }

    #[test]
    fn leaving_a_block_out_is_fitting_without_it() {
        let rows = draw(1, 0.5);
        let (found, all) = (evidence(&rows), fitted(&rows, |_| true));
        for block in 0..BLOCKS {
            let without = fitted(&rows, |b| usize::from(b) != block);
            (0..2).for_each(|i| assert!((found.moves[block][i] - (without[i] - all[i])).abs() < 1e-10));
            let own = rows.iter().filter(|r| usize::from(r.2) == block);
            let error: f64 = own.map(|(x, r, _)| (r - x[0] * without[0] - x[1] * without[1]).powi(2)).sum();
            let cell = found.cells.iter().position(|c| c.block == block).expect("a cell");
            assert!((found.predicted[cell] - error).abs() < 1e-8, "{} {error}", found.predicted[cell]);
        }
    }

    #[test]
    fn the_jackknife_knows_what_blocks_share() {
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

    #[test]
    fn residuals_that_last_count_less() {
        let white = evidence(&draw(3, 0.0)).independent;
        let lasting = evidence(&draw(3, 3.0)).independent;
        assert!(white > 0.95 && lasting < 0.2, "{white} {lasting}");
    }

    #[test]
    fn a_gain_that_one_block_makes_alone_may_be_chance() {
        let rows = draw(5, 0.0);
        let mut odd = rows.clone();
        odd.iter_mut().filter(|r| r.2 == 3).for_each(|r| r.1 += 30.0);
        let (plain, odd) = (evidence(&rows), evidence(&odd));
        assert!(plain.gains_over(&odd).iter().sum::<f64>() > 100.0);
        assert!(plain.chance_of_gain(&odd) > 0.05);
    }
}
