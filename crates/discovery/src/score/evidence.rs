//! Evidence of each block on a fit's parameters, and what follows from it without another fit.
//!
//! Of block `b` with residuals `r` and sensitivities `J` (own unknowns projected out, windows weighted):
//!
//! ```text
//! H_b = J'J   g_b = J'r   H = sum H_b
//! (1) without block b the parameters move by  d_b = -(H - H_b)^-1 g_b
//! (2) its squared prediction error is         r'r - 2 d_b'g_b + d_b'H_b d_b
//! (3) covariance of the parameters            (B - 1)/B sum (d_b - mean)(d_b - mean)'
//! ```
//!
//! (1) is one step of Gauss and Newton (approximate leave-one-out: Beirami et al. 2017; Giordano et al. 2019), (3) the block jackknife
//! (Kuensch 1989).

use super::blocks::Blocks;
use super::independence::Memory;
use super::jackknife::{covariance, distance, freedom, move_without};
use super::rows::{Rows, WindowRows};
use crate::evaluate::{cost_and_weight, softening};
use crate::linear::Square;
use crate::statistics::f_tail;
use augsim_linear::gram_of_rows;
use rayon::prelude::*;

/// Neighbouring blocks whose moves are taken together, to each side.
const LAGS: usize = 2;

/// Independent residuals that a block must have where windows reach over blocks. Of residuals that are forgotten in T samples one in 2 T is
/// independent, and blocks of L samples understate a variance by the share T / L for what neighbours share (Kuensch 1989), of which the
/// covariance of neighbours with its weight of 2/3 makes up two thirds: with 7, one in 42 is missing, which raises a chance that five
/// standard errors show by less than half.
const APART: f64 = 7.0;

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
    /// Entries of theta that are not held.
    moving: Vec<usize>,
    /// `H_b` of the moving entries.
    curvatures: Vec<Square>,
    /// How the parameters move when each block is left out; entries that are held do not move.
    pub moves: Vec<Vec<f64>>,
    /// Squared prediction error of each cell by parameters that did not see its block.
    predicted: Vec<f64>,
    cost: f64,
    /// How long residuals last.
    pub memory: Memory,
}

impl Evidence {
    /// Evidence of the rows of a fit; entries of theta that are `held` (at a bound) do not move, and each is `off` its null by so much.
    pub fn new(rows: &Rows, of: &Blocks, held: &[bool], off: &[f64]) -> Self {
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
        let moving: Vec<usize> = (0..held.len()).filter(|i| !held[*i]).collect();
        let (curvatures, gradients) = by_block(&cells, &scales, blocks, &moving);
        let moves = moves(&curvatures, &gradients, &moving, off);
        let after = |cell: &Cell| cell.c - cell.h.fall(&cell.g, &moves[cell.block]);
        let predicted = cells.iter().map(after).collect();
        let mut found = Self {
            blocks,
            touch,
            cells,
            scales,
            moving,
            curvatures,
            moves,
            predicted,
            cost: 0.0,
            memory: Memory::of(rows),
        };
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
                gains[cell.block] += sign * self.memory.independent * slope * predicted;
                first[cell.window].get_or_insert(cell.block);
            }
            for (scale, block) in evidence.scales.iter().zip(first) {
                block
                    .into_iter()
                    .for_each(|b: usize| gains[b] += sign * self.memory.independent * scale.constant);
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

    /// Whether a window reaches over blocks with residuals that last so long that these blocks are not independent. Windows inside a block
    /// have starts of their own, and share nothing with others.
    pub fn blocks_share_residuals(&self) -> bool {
        let reaches_over = self.scales.len() < self.blocks;
        self.touch
            && reaches_over
            && self.memory.independent * self.memory.samples / (self.blocks as f64) < APART
    }

    /// Degrees of freedom of the covariance (3) of some parameters that move.
    pub fn freedom(&self, entries: &[usize]) -> f64 {
        let places: Vec<usize> =
            entries.iter().filter_map(|entry| self.moving.iter().position(|i| i == entry)).collect();
        freedom(&sum(&self.curvatures), self.curvatures.iter(), &places)
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

/// `H_b` and `g_b` of the moving entries of every block.
fn by_block(
    cells: &[Cell],
    scales: &[Scale],
    blocks: usize,
    moving: &[usize],
) -> (Vec<Square>, Vec<Vec<f64>>) {
    let n = moving.len();
    let (mut curvatures, mut gradients) = (vec![Square::zero(n); blocks], vec![vec![0.0; n]; blocks]);
    for cell in cells {
        let weight = if cell.is_prior { 1.0 } else { scales[cell.window].weight };
        let (h, g) = (&mut curvatures[cell.block], &mut gradients[cell.block]);
        h.a.iter_mut().zip(&cell.h.sub(moving).a).for_each(|(a, x)| *a += weight * x);
        g.iter_mut().zip(moving).for_each(|(a, &i)| *a += weight * cell.g[i]);
    }
    (curvatures, gradients)
}

/// (1) for every block, of all entries.
fn moves(curvatures: &[Square], gradients: &[Vec<f64>], moving: &[usize], off: &[f64]) -> Vec<Vec<f64>> {
    let sum = sum(curvatures);
    let from_null: Vec<f64> = moving.iter().map(|&i| off[i]).collect();
    let without = |(h, g): (&Square, &Vec<f64>)| {
        let mut all = vec![0.0; off.len()];
        moving.iter().zip(move_without(&sum, h, g, &from_null)).for_each(|(&i, d)| all[i] = d);
        all
    };
    curvatures.iter().zip(gradients).map(without).collect()
}

/// Sum of matrices of one size.
fn sum(all: &[Square]) -> Square {
    let mut sum = Square::zero(all.first().map_or(0, |h| h.n));
    all.iter().for_each(|h| sum.a.iter_mut().zip(&h.a).for_each(|(a, x)| *a += x));
    sum
}

#[cfg(test)]
mod tests {
    //! Contract, on a linear model, where one step of Gauss and Newton is exact: moves and predictions of left-out blocks are those of fits
    //! without them, and the jackknife's variance is that of the estimate over repetitions.
    use super::*;
    use crate::statistics::hotelling_tail;
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
        Evidence::new(&Rows::of_linear_model(&rows), &Blocks::apart(BLOCKS), &[false; 2], &[0.0; 2])
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

    /// Share of draws without an effect in which the second column is significant at a level of 1 %, where all blocks but four say a tenth as
    /// much of it.
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
    fn few_blocks_that_say_something_make_no_more_false_findings() {
        let (own, all) = (false_findings(|e| e.freedom(&[1])), false_findings(|_| BLOCKS as f64 - 1.0));
        assert!(own < 0.015 && all > 0.02, "{own} {all}");
    }

    /// Whether residuals are shared in one window over all blocks, each of which has so many independent ones.
    fn shares(in_a_block: f64) -> bool {
        let mut found = evidence(&draw(1, 0.0));
        found.touch = true;
        found.memory.independent = in_a_block / ROWS as f64;
        found.blocks_share_residuals()
    }

    #[test]
    fn a_window_reaches_over_blocks_only_where_residuals_are_soon_forgotten() {
        // A limit twice or half as large fails.
        assert!(shares(5.0) && !shares(9.0));
    }

    #[test]
    fn residuals_that_last_count_less() {
        let white = evidence(&draw(3, 0.0)).memory.independent;
        let lasting = evidence(&draw(3, 3.0)).memory.independent;
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
