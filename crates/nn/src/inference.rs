//! Layers without a tape, for sampling and for control loops that run one step at a time.
//!
//! Weights are packed once, and nothing is allocated after construction. Sequences are `[time, feature,
//! lane]`, as on the tape. A runner is made for a number of lanes and a maximum number of steps per call, and
//! keeps its states between calls.

use crate::{GaussianHead, Gru, Linear, Mlp, ParamId, Params};
use augsim_tensor::kernels::draw::{Draw, draw};
use augsim_tensor::kernels::{GruWeights, LinearDims, LinearForward, PackedGru, linear_simd, pointwise};
use augsim_tensor::simd::Level;

/// A stack of GRU layers with its hidden states, which runs without a tape.
#[derive(Debug, Clone)]
pub struct GruRunner {
    layers: Vec<PackedGru>,
    states: Vec<Vec<f32>>,
    outputs: [Vec<f32>; 2],
    scratch: Vec<f32>,
    lanes: usize,
}

impl GruRunner {
    /// Packs the weights of `gru`, for `lanes` sequences and at most `steps` steps per call.
    ///
    /// The hidden states are initially 0.
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

    /// Sets all hidden states to 0.
    pub fn reset(&mut self) {
        self.states.iter_mut().for_each(|s| s.fill(0.0));
    }

    /// Computes the hidden states of the last layer, `[steps, hidden, lane]`, for `x [steps, input, lane]`.
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

/// An affine layer that runs without a tape; see [`Linear`].
#[derive(Debug, Clone)]
pub struct LinearRunner {
    w: Vec<f32>,
    b: Vec<f32>,
    y: Vec<f32>,
    scratch: Vec<f32>,
    lanes: usize,
}

impl LinearRunner {
    /// Copies the weights of `linear`, for `lanes` sequences and at most `steps` steps per call.
    pub fn new(linear: Linear, params: &Params<f32>, lanes: usize, steps: usize) -> Self {
        Self::concatenated(&[linear], params, lanes, steps)
    }

    /// Joins layers with the same inputs to one layer, whose outputs are theirs one after the other.
    fn concatenated(layers: &[Linear], params: &Params<f32>, lanes: usize, steps: usize) -> Self {
        let concatenate = |id: fn(&Linear) -> ParamId| -> Vec<f32> {
            layers.iter().flat_map(|layer| params.get(id(layer)).iter().copied()).collect()
        };
        let (w, b) = (concatenate(|layer| layer.weight), concatenate(|layer| layer.bias));
        let scratch = vec![0.0; linear_simd::scratch(w.len() / b.len().max(1), b.len())];
        LinearRunner { y: vec![0.0; steps * b.len() * lanes], w, b, scratch, lanes }
    }

    /// Applies the affine layer: maps `x [steps, in, lane]` to `[steps, out, lane]`.
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

/// A multi-layer perceptron that runs without a tape; see [`Mlp`].
#[derive(Debug, Clone)]
pub struct MlpRunner(Vec<LinearRunner>);

impl MlpRunner {
    /// Copies the weights of `mlp`, for `lanes` sequences and at most `steps` steps per call.
    pub fn new(mlp: &Mlp, params: &Params<f32>, lanes: usize, steps: usize) -> Self {
        MlpRunner(mlp.layers.iter().map(|layer| LinearRunner::new(*layer, params, lanes, steps)).collect())
    }

    /// Applies the perceptron: maps `x [steps, in, lane]` to `[steps, out, lane]`.
    pub fn run<'a>(&'a mut self, x: &'a [f32], steps: usize) -> &'a [f32] {
        let mut features = x;
        for layer in &mut self.0 {
            features = layer.forward(features, steps, true);
        }
        features
    }
}

/// An output layer for a standard deviation: affine, then softplus, then the addition of a floor.
#[derive(Debug, Clone)]
pub struct SdRunner {
    raw: LinearRunner,
    sd: Vec<f32>,
    floor: f32,
}

impl SdRunner {
    /// Copies the weights of the layer `std`, for `lanes` sequences and at most `steps` steps per call.
    pub fn new(std: Linear, floor: f64, params: &Params<f32>, lanes: usize, steps: usize) -> Self {
        let raw = LinearRunner::new(std, params, lanes, steps);
        SdRunner { sd: vec![0.0; raw.y.len()], raw, floor: floor as f32 }
    }

    /// Computes standard deviations `[steps, out, lane]` for features `x [steps, in, lane]`.
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

/// A Gaussian output layer that runs without a tape; see [`GaussianHead`].
#[derive(Debug, Clone)]
pub struct GaussianRunner {
    mean: LinearRunner,
    sd: SdRunner,
}

impl GaussianRunner {
    /// Copies the weights of `head`, for `lanes` sequences and at most `steps` steps per call.
    pub fn new(head: GaussianHead, params: &Params<f32>, lanes: usize, steps: usize) -> Self {
        GaussianRunner {
            mean: LinearRunner::new(head.mean, params, lanes, steps),
            sd: SdRunner::new(head.std, head.sd_floor, params, lanes, steps),
        }
    }

    /// Computes mean and standard deviation, `[steps, out, lane]` each, for features `x [steps, in, lane]`.
    pub fn run(&mut self, x: &[f32], steps: usize) -> (&[f32], &[f32]) {
        (self.mean.run(x, steps), self.sd.run(x, steps))
    }
}

/// Draws samples from the Gaussian that a [`GaussianHead`] predicts, without a tape.
#[derive(Debug, Clone)]
pub struct DrawRunner {
    heads: LinearRunner,
    floor: f32,
    z: Vec<f32>,
    row: usize,
}

impl DrawRunner {
    /// Copies the weights of `head`, for `lanes` sequences and at most `steps` steps per call.
    pub fn new(head: GaussianHead, params: &Params<f32>, lanes: usize, steps: usize) -> Self {
        let row = params.get(head.mean.bias).len() * lanes;
        DrawRunner {
            heads: LinearRunner::concatenated(&[head.mean, head.std], params, lanes, steps),
            floor: head.sd_floor as f32,
            z: vec![0.0; steps * row],
            row,
        }
    }

    /// Draws samples `mean + eps sd`, `[steps, out, lane]`, for features `x [steps, in, lane]`.
    ///
    /// `eps [steps, out, lane]` are standard normal random numbers.
    pub fn run(&mut self, x: &[f32], eps: &[f32], steps: usize) -> &[f32] {
        let z = &mut self.z[..steps * self.row];
        let heads = &*self.heads.run(x, steps);
        draw(Draw { heads, eps, floor: self.floor, row: self.row, z });
        z
    }
}
