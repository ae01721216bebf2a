//! Training iterations of a net on synthetic inputs, split into tiles of sequences as in the trainer.

use crate::ok;
use augsim_nn::{Adam, AdamState, Bound, Params};
use augsim_tensor::Tape;
use augsim_tensor::kernels::normal::NormalLanes;
use augsim_trainer::TILE;
use augsim_trainer::nets::{Dcvrnn, Tile};
use rayon::prelude::*;

/// Numbers of state, condition and latent columns of a net.
fn widths(net: &Dcvrnn) -> [usize; 3] {
    let s = net.sizes();
    [s.state, s.condition, s.latent]
}

/// Buffers of one thread for a training iteration.
#[derive(Debug, Default)]
struct Workspace {
    tape: Tape<f32>,
    bound: Bound,
    eps: Vec<f32>,
    grads: Vec<Vec<f32>>,
}

/// A training run of a net on synthetic inputs, which are equal in every tile of sequences.
#[derive(Debug)]
pub struct Synthetic {
    net: Dcvrnn,
    params: Params<f32>,
    adam: AdamState<f32>,
    grads: Vec<f32>,
    workspaces: Vec<Workspace>,
    inputs: [Vec<f32>; 2],
    batch: usize,
    time: usize,
    iteration: u64,
}

impl Synthetic {
    /// A training run of `net` with `batch` sequences of `time` steps.
    pub fn new(net: Dcvrnn, params: Params<f32>, batch: usize, time: usize) -> Self {
        let [x, u, _] = widths(&net);
        let draw = |seed: u64, width: usize| {
            let mut out = vec![0.0; time * width * TILE];
            NormalLanes::new((0..TILE as u64).map(|lane| [seed, lane + 1])).fill(&mut out);
            out
        };
        let n = params.values().len();
        Synthetic {
            inputs: [draw(1, x), draw(2, u)],
            adam: AdamState::new(n),
            grads: vec![0.0; n],
            workspaces: Vec::new(),
            iteration: 0,
            net,
            params,
            batch,
            time,
        }
    }

    /// Runs one training iteration on the synthetic inputs.
    ///
    /// # Panics
    /// If net and inputs do not fit together.
    pub fn step(&mut self) {
        let tiles = self.batch.div_ceil(TILE);
        let chunks = tiles.min(rayon::current_num_threads());
        self.workspaces.resize_with(chunks, Workspace::default);
        let (net, params, inputs) = (&self.net, &self.params, &self.inputs);
        let (batch, time, iteration) = (self.batch, self.time, self.iteration);
        self.workspaces.par_iter_mut().enumerate().for_each(|(chunk, work)| {
            let [first, end] = [chunk, chunk + 1].map(|i| i * tiles / chunks);
            work.grads.resize_with(end - first, || vec![0.0; params.values().len()]);
            for (index, tile) in (first..end).enumerate() {
                let lanes = TILE.min(batch - tile * TILE);
                let [x, u, latent] = widths(net);
                work.eps.resize(time * latent * lanes, 0.0);
                let seeds = (0..lanes).map(|lane| [iteration + 1, (tile * TILE + lane) as u64]);
                NormalLanes::new(seeds).fill(&mut work.eps);
                let tape = &mut work.tape;
                tape.reset();
                ok(params.bind(tape, &mut work.bound));
                let [xs, us] = [(0, x), (1, u)].map(|(i, width)| &inputs[i][..time * width * lanes]);
                let tile = Tile { time, lanes, x: xs, u: us, eps: &work.eps, mask: &[] };
                ok(net.differentiate(tape, &work.bound, tile, 1.0 / batch as f64));
                params.gather_grads(tape, &work.bound, &mut work.grads[index]);
            }
        });
        self.grads.fill(0.0);
        for tile in self.workspaces.iter().flat_map(|w| &w.grads) {
            self.grads.iter_mut().zip(tile).for_each(|(g, t)| *g += *t);
        }
        Adam::default().step(&mut self.adam, self.params.values_mut(), &self.grads, 1e-3);
        self.iteration += 1;
    }
}
