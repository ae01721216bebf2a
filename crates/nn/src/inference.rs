//! Layers without a tape: weights packed once, nothing recorded, nothing allocated after construction. For
//! sampling and for control loops that take one step at a time.
//!
//! Sequences are `[time, feature, lane]`, as on the tape; a runner is made for a number of lanes and for at
//! most so many steps at once, and carries its states from call to call.

use crate::{GaussianHead, Gru, Linear, Mlp, Params};
use augsim_tensor::kernels::draw::{Draw, draw};
use augsim_tensor::kernels::{GruWeights, LinearDims, LinearForward, PackedGru, linear_simd, pointwise};
use augsim_tensor::simd::Level;

/// A stack of GRU layers with its states.
#[derive(Debug, Clone)]
pub struct GruRunner {
    layers: Vec<PackedGru>,
    states: Vec<Vec<f32>>,
    outputs: [Vec<f32>; 2],
    scratch: Vec<f32>,
    lanes: usize,
}

impl GruRunner {
    /// The layers of `gru` for `lanes` sequences and at most `steps` steps at once, in state zero.
    pub fn new(gru: &Gru, params: &Params<f32>, lanes: usize, steps: usize) -> Self {
        let layers: Vec<PackedGru> = gru
            .layers
            .iter()
            .map(|l| {
                let [w_ih, w_hh, b_ih, b_hh] = [l.w_ih, l.w_hh, l.b_ih, l.b_hh].map(|id| params.get(id));
                let hidden = b_ih.len() / 3;
                let input = w_ih.len() / b_ih.len().max(1);
                PackedGru::new(Level::current(), GruWeights { w_ih, w_hh, b_ih, b_hh }, input, hidden)
            })
            .collect();
        let widest = layers.iter().map(PackedGru::hidden).max().unwrap_or(0);
        GruRunner {
            states: layers.iter().map(|l| vec![0.0; l.hidden() * lanes]).collect(),
            outputs: [0, 1].map(|_| vec![0.0; steps * widest * lanes]),
            scratch: vec![0.0; layers.iter().map(PackedGru::scratch).max().unwrap_or(0)],
            layers,
            lanes,
        }
    }

    /// Back to state zero.
    pub fn reset(&mut self) {
        self.states.iter_mut().for_each(|s| s.fill(0.0));
    }

    /// States of all layers, `[hidden, lane]` each: what a control loop saves to try several continuations.
    pub fn states_mut(&mut self) -> impl Iterator<Item = &mut [f32]> {
        self.states.iter_mut().map(|s| &mut s[..])
    }

    /// Hidden states of the last layer `[steps, hidden, lane]` for `x [steps, input, lane]`.
    pub fn run(&mut self, x: &[f32], steps: usize) -> &[f32] {
        let [from, to] = &mut self.outputs;
        let mut len = 0;
        for (i, (layer, state)) in self.layers.iter().zip(&mut self.states).enumerate() {
            let below = if i == 0 { x } else { &from[..len] };
            len = steps * layer.hidden() * self.lanes;
            layer.run(below, state, &mut to[..len], &mut self.scratch);
            std::mem::swap(from, to);
        }
        &from[..len]
    }
}

/// An affine layer.
#[derive(Debug, Clone)]
pub struct LinearRunner {
    w: Vec<f32>,
    b: Vec<f32>,
    y: Vec<f32>,
    scratch: Vec<f32>,
    lanes: usize,
}

impl LinearRunner {
    /// `linear` for `lanes` sequences and at most `steps` steps at once.
    pub fn new(linear: Linear, params: &Params<f32>, lanes: usize, steps: usize) -> Self {
        Self::stacked(&[linear], params, lanes, steps)
    }

    /// Layers of the same inputs as one, their outputs one after another.
    fn stacked(layers: &[Linear], params: &Params<f32>, lanes: usize, steps: usize) -> Self {
        let [w, b] = [0, 1].map(|part| {
            let ids = layers.iter().map(|l| if part == 0 { l.weight } else { l.bias });
            ids.flat_map(|id| params.get(id).iter().copied()).collect::<Vec<f32>>()
        });
        let scratch = vec![0.0; linear_simd::scratch(w.len() / b.len().max(1), b.len())];
        LinearRunner { y: vec![0.0; steps * b.len() * lanes], w, b, scratch, lanes }
    }

    /// `[steps, out, lane]` for `x [steps, in, lane]`.
    pub fn run(&mut self, x: &[f32], steps: usize) -> &mut [f32] {
        self.forward(x, steps, false)
    }

    fn forward(&mut self, x: &[f32], steps: usize, tanh: bool) -> &mut [f32] {
        let output = self.b.len();
        let input = self.w.len() / output.max(1);
        let y = &mut self.y[..steps * output * self.lanes];
        let dims = LinearDims { time: steps, input, output, batch: self.lanes };
        let args = LinearForward { dims, w: &self.w, b: &self.b, x, y, tanh };
        linear_simd::forward(args, &mut self.scratch);
        y
    }
}

/// Affine layers, each followed by tanh.
#[derive(Debug, Clone)]
pub struct MlpRunner(Vec<LinearRunner>);

impl MlpRunner {
    /// `mlp` for `lanes` sequences and at most `steps` steps at once.
    pub fn new(mlp: &Mlp, params: &Params<f32>, lanes: usize, steps: usize) -> Self {
        MlpRunner(mlp.layers.iter().map(|layer| LinearRunner::new(*layer, params, lanes, steps)).collect())
    }

    /// `[steps, out, lane]` for `x [steps, in, lane]`.
    pub fn run<'a>(&'a mut self, x: &'a [f32], steps: usize) -> &'a [f32] {
        let mut seen = x;
        for layer in &mut self.0 {
            seen = layer.forward(seen, steps, true);
        }
        seen
    }
}

/// A standard deviation: affine, softplus, floor.
#[derive(Debug, Clone)]
pub struct SdRunner {
    raw: LinearRunner,
    sd: Vec<f32>,
    floor: f32,
}

impl SdRunner {
    /// The deviation that `std` gives before softplus and a floor.
    pub fn new(std: Linear, floor: f64, params: &Params<f32>, lanes: usize, steps: usize) -> Self {
        let raw = LinearRunner::new(std, params, lanes, steps);
        SdRunner { sd: vec![0.0; raw.y.len()], raw, floor: floor as f32 }
    }

    /// `[steps, out, lane]` for `x [steps, in, lane]`.
    pub fn run(&mut self, x: &[f32], steps: usize) -> &[f32] {
        let raw = self.raw.run(x, steps);
        let sd = &mut self.sd[..raw.len()];
        pointwise::softplus(raw, sd);
        for sd in &mut *sd {
            *sd += self.floor;
        }
        sd
    }
}

/// A Gaussian head: mean and standard deviation.
#[derive(Debug, Clone)]
pub struct GaussianRunner {
    mean: LinearRunner,
    sd: SdRunner,
}

impl GaussianRunner {
    /// `head` for `lanes` sequences and at most `steps` steps at once.
    pub fn new(head: GaussianHead, params: &Params<f32>, lanes: usize, steps: usize) -> Self {
        GaussianRunner {
            mean: LinearRunner::new(head.mean, params, lanes, steps),
            sd: SdRunner::new(head.std, head.sd_floor, params, lanes, steps),
        }
    }

    /// Mean and standard deviation, `[steps, out, lane]` each, for `x [steps, in, lane]`.
    pub fn run(&mut self, x: &[f32], steps: usize) -> (&[f32], &[f32]) {
        (self.mean.run(x, steps), self.sd.run(x, steps))
    }
}

/// Draws from a Gaussian head.
#[derive(Debug, Clone)]
pub struct DrawRunner {
    heads: LinearRunner,
    floor: f32,
    z: Vec<f32>,
    row: usize,
}

impl DrawRunner {
    /// `head` for `lanes` sequences and at most `steps` steps at once.
    pub fn new(head: GaussianHead, params: &Params<f32>, lanes: usize, steps: usize) -> Self {
        let row = params.get(head.mean.bias).len() * lanes;
        DrawRunner {
            heads: LinearRunner::stacked(&[head.mean, head.std], params, lanes, steps),
            floor: head.sd_floor as f32,
            z: vec![0.0; steps * row],
            row,
        }
    }

    /// mean + eps sd, `[steps, out, lane]`, for `x [steps, in, lane]` and `eps [steps, out, lane]`.
    pub fn run(&mut self, x: &[f32], eps: &[f32], steps: usize) -> &[f32] {
        let z = &mut self.z[..steps * self.row];
        let heads = &*self.heads.run(x, steps);
        draw(Draw { heads, eps, floor: self.floor, row: self.row, z });
        z
    }
}
