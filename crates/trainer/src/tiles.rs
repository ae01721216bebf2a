//! Batch tiles: groups of up to [`TILE`] trajectories of a batch, the units of parallel work.
//!
//! The batch alone determines the tiles, and their gradients are added in tile order, so that a run gives the
//! same bits on any number of threads.

use crate::nets::{Losses, Net, Tile};
use crate::noise::normals;
use crate::prepared::Prepared;
use crate::{TILE, TrainerError};
use augsim_nn::{Bound, Params};
use augsim_tensor::{Tape, TensorError};

/// A net that is trained by gradients, computed on one batch tile (group of trajectories) at a time.
pub(crate) trait Trainable: Sync {
    /// Number of rows of noise for a sequence of `time` rows, and number of noise values per row.
    fn noise_rows(&self, time: usize) -> (usize, usize);

    /// Computes the loss of a batch tile (group of trajectories), and `scale` times its gradient.
    /// The gradient is with respect to the parameters `p`, and stays on the tape.
    fn differentiate(
        &self,
        tape: &mut Tape<f32>,
        p: &Bound,
        tile: Tile<'_, f32>,
        scale: f64,
    ) -> Result<Losses<f32>, TensorError>;
}

impl Trainable for Net {
    fn noise_rows(&self, time: usize) -> (usize, usize) {
        Net::noise_rows(self, time)
    }

    fn differentiate(
        &self,
        tape: &mut Tape<f32>,
        p: &Bound,
        tile: Tile<'_, f32>,
        scale: f64,
    ) -> Result<Losses<f32>, TensorError> {
        Net::differentiate(self, tape, p, tile, scale)
    }
}

/// Two parts of the loss of a batch tile: divergence and negative log-likelihood.
/// Nats, summed over the tile's trajectories.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct TileLoss {
    pub kl: f64,
    pub negative_ln_likelihood: f64,
}

/// Gradient and loss of one batch tile.
#[derive(Debug, Default)]
pub(crate) struct TileResult {
    pub grads: Vec<f32>,
    pub loss: TileLoss,
}

/// Writes the sum of the tiles' gradients, added in tile order, to `grads`; returns their summed loss times `scale`.
pub(crate) fn sum_gradients<'t>(
    tiles: impl IntoIterator<Item = &'t TileResult>,
    scale: f64,
    grads: &mut [f32],
) -> TileLoss {
    grads.fill(0.0);
    let mut sum = TileLoss::default();
    for tile in tiles {
        grads.iter_mut().zip(&tile.grads).for_each(|(g, t)| *g += *t);
        sum.kl += tile.loss.kl * scale;
        sum.negative_ln_likelihood += tile.loss.negative_ln_likelihood * scale;
    }
    sum
}

/// Rescales a gradient to a norm of at most `limit`; returns the norm before. `None` does not rescale.
pub(crate) fn clip(grads: &mut [f32], limit: Option<f64>) -> f64 {
    let norm = grads.iter().map(|g| f64::from(*g).powi(2)).sum::<f64>().sqrt();
    if let Some(limit) = limit
        && norm > limit
    {
        let factor = (limit / norm) as f32;
        grads.iter_mut().for_each(|g| *g *= factor);
    }
    norm
}

/// Buffers in which a thread processes its tiles one after another, kept between iterations.
///
/// One per thread, not per tile, so that the tape of a tile (about 13 MB for the ball) is reused from cache.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    tape: Tape<f32>,
    bound: Bound,
    x: Vec<f32>,
    u: Vec<f32>,
    eps: Vec<f32>,
    mask: Vec<f32>,
    /// Gradients and losses of the tiles that this thread processed, in tile order.
    pub results: Vec<TileResult>,
}

/// Inputs that all tiles of an iteration share.
#[derive(Clone, Copy)]
pub(crate) struct TileContext<'a> {
    pub net: &'a dyn Trainable,
    pub params: &'a Params<f32>,
    /// All trajectories of the training set; tiles refer to them by index.
    pub train_set: &'a [Prepared],
    /// Factor of a tile's gradient (1 / batch size).
    pub scale: f64,
    pub seed: u64,
}

impl Workspace {
    /// Processes the trajectories `items` (indices into the training set) in tiles.
    ///
    /// The noise of the k-th item comes from random stream `first + k`; `first` counts all trajectories
    /// processed since the start of training, so that no stream is used twice.
    pub fn run_all(
        &mut self,
        shared: TileContext<'_>,
        items: &[usize],
        first: u64,
    ) -> Result<(), TrainerError> {
        let mut results = std::mem::take(&mut self.results);
        results.resize_with(items.len().div_ceil(TILE), TileResult::default);
        let mut tiles = results.iter_mut().zip(items.chunks(TILE)).enumerate();
        let outcome = tiles
            .try_for_each(|(i, (result, items))| self.run(shared, items, first + (i * TILE) as u64, result));
        self.results = results;
        outcome
    }

    /// Computes the loss and the scaled gradient of one tile, summed over its trajectories `items`.
    fn run(
        &mut self,
        shared: TileContext<'_>,
        items: &[usize],
        first: u64,
        result: &mut TileResult,
    ) -> Result<(), TrainerError> {
        let TileContext { net, params, train_set: all, scale, seed } = shared;
        let lanes = items.len();
        debug_assert!(lanes <= TILE);
        let time = items.iter().map(|&i| all[i].time).max().unwrap_or(0);
        self.fill(net, all, items, time);
        normals(seed, "noise", first, lanes).fill(&mut self.eps);
        result.grads.resize(params.values().len(), 0.0);
        self.tape.reset();
        params.bind(&mut self.tape, &mut self.bound)?;
        let tile = Tile { time, lanes, x: &self.x, u: &self.u, eps: &self.eps, mask: &self.mask };
        let loss = net.differentiate(&mut self.tape, &self.bound, tile, scale)?;
        params.gather_grads(&self.tape, &self.bound, &mut result.grads);
        result.loss = TileLoss {
            kl: f64::from(loss.kl),
            negative_ln_likelihood: f64::from(loss.negative_ln_likelihood),
        };
        // Resetting here as well makes the first iteration allocate all that the tape needs to recycle its
        // buffers.
        self.tape.reset();
        Ok(())
    }

    /// Sizes the buffers for a tile, and writes targets, conditions and mask (not the noise) to them.
    fn fill(&mut self, net: &dyn Trainable, all: &[Prepared], items: &[usize], time: usize) {
        let lanes = items.len();
        let (x_width, u_width) = items.first().map_or((0, 0), |&i| (all[i].x_width, all[i].u_width));
        let (rows, latent) = net.noise_rows(time);
        let has_equal_lengths = items.iter().all(|&i| all[i].time == time);
        for (buffer, n) in [
            (&mut self.x, time * x_width),
            (&mut self.u, time * u_width),
            (&mut self.eps, rows * latent),
            (&mut self.mask, if has_equal_lengths { 0 } else { time }),
        ] {
            buffer.clear();
            buffer.resize(n * lanes, 0.0);
        }
        for (lane, &i) in items.iter().enumerate() {
            let item = &all[i];
            for (to, from) in [(&mut self.x, &item.x), (&mut self.u, &item.u)] {
                for (slot, v) in to[lane..].iter_mut().step_by(lanes).zip(from) {
                    *slot = *v;
                }
            }
            if !has_equal_lengths {
                for slot in self.mask[lane..].iter_mut().step_by(lanes).take(item.time) {
                    *slot = 1.0;
                }
            }
        }
    }
}
