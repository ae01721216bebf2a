//! Batch tiles: the unit of parallel work. Tiles are fixed by the batch, not by the threads, and their
//! gradients are added in tile order, so that a run gives the same bytes on any number of threads.

use crate::nets::{Net, Tile};
use crate::noise::normals;
use crate::prepare::Prepared;
use crate::{TILE, TrainerError};
use augsim_nn::{Bound, Params};
use augsim_tensor::Tape;

/// Sums over the trajectories of one tile.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct TileLoss {
    pub kl: f64,
    pub misfit: f64,
}

/// What a tile gives.
#[derive(Debug, Default)]
pub(crate) struct TileResult {
    pub grads: Vec<f32>,
    pub loss: TileLoss,
}

/// Memory that tiles are worked on in, one after another, kept from iteration to iteration. As many as
/// threads: what a tile records (some 13 MB for the ball) then stays in cache for the next one.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    tape: Tape<f32>,
    bound: Bound,
    x: Vec<f32>,
    u: Vec<f32>,
    eps: Vec<f32>,
    mask: Vec<f32>,
    /// What its tiles gave, in their order.
    pub results: Vec<TileResult>,
}

/// Which noise a tile draws: one stream per (seed, iteration, place in the batch).
#[derive(Debug, Clone, Copy)]
pub(crate) struct NoiseKey {
    pub seed: u64,
    pub first: u64,
}

impl Workspace {
    /// Works on all of its tiles, of which `items` lists the trajectories (indices into `all`), the first of
    /// them number `noise.first` of all ever drawn.
    pub fn run_all(
        &mut self,
        net: &Net,
        params: &Params<f32>,
        all: &[Prepared],
        items: &[usize],
        noise: NoiseKey,
        scale: f64,
    ) -> Result<(), TrainerError> {
        let mut results = std::mem::take(&mut self.results);
        results.resize_with(items.len().div_ceil(TILE), TileResult::default);
        let mut outcome = Ok(());
        for (i, (result, items)) in results.iter_mut().zip(items.chunks(TILE)).enumerate() {
            let noise = NoiseKey { first: noise.first + (i * TILE) as u64, ..noise };
            outcome = outcome.and_then(|()| self.run(net, params, all, items, noise, scale, result));
        }
        self.results = results;
        outcome
    }

    /// Loss and gradient of `scale` times the sum over the trajectories `items` of `all`.
    #[expect(clippy::too_many_arguments, reason = "what a tile is made of, and where its result goes")]
    fn run(
        &mut self,
        net: &Net,
        params: &Params<f32>,
        all: &[Prepared],
        items: &[usize],
        noise: NoiseKey,
        scale: f64,
        result: &mut TileResult,
    ) -> Result<(), TrainerError> {
        let lanes = items.len();
        debug_assert!(lanes <= TILE);
        let time = items.iter().map(|&i| all[i].time).max().unwrap_or(0);
        self.fill(net, all, items, time, noise);
        result.grads.resize(params.values().len(), 0.0);
        self.tape.reset();
        params.bind(&mut self.tape, &mut self.bound)?;
        let tile = Tile { time, lanes, x: &self.x, u: &self.u, eps: &self.eps, mask: &self.mask };
        let loss = net.differentiate(&mut self.tape, &self.bound, tile, scale)?;
        params.gather_grads(&self.tape, &self.bound, &mut result.grads);
        result.loss = TileLoss { kl: f64::from(loss.kl), misfit: f64::from(loss.misfit) };
        // Also here: what the tape needs to take its buffers back is then allocated by the first iteration.
        self.tape.reset();
        Ok(())
    }

    fn fill(&mut self, net: &Net, all: &[Prepared], items: &[usize], time: usize, noise: NoiseKey) {
        let lanes = items.len();
        let (x_width, u_width) = items.first().map_or((0, 0), |&i| (all[i].x_width, all[i].u_width));
        let (rows, latent) = net.noise_rows(time);
        let equal = items.iter().all(|&i| all[i].time == time);
        for (buffer, n) in [
            (&mut self.x, time * x_width),
            (&mut self.u, time * u_width),
            (&mut self.eps, rows * latent),
            (&mut self.mask, if equal { 0 } else { time }),
        ] {
            buffer.clear();
            buffer.resize(n * lanes, 0.0);
        }
        normals(noise.seed, "noise", noise.first, lanes).fill(&mut self.eps);
        for (lane, &i) in items.iter().enumerate() {
            let item = &all[i];
            for (to, from) in [(&mut self.x, &item.x), (&mut self.u, &item.u)] {
                for (slot, v) in to[lane..].iter_mut().step_by(lanes).zip(from) {
                    *slot = *v;
                }
            }
            if !equal {
                for slot in self.mask[lane..].iter_mut().step_by(lanes).take(item.time) {
                    *slot = 1.0;
                }
            }
        }
    }
}
