//! Kernels on operands of given extents, as the roofline table and the criterion benches run them.

use augsim_tensor::kernels::{
    GruBackward, GruDims, GruForward, GruWeights, LinearBackward, LinearDims, LinearForward, MatmulDims,
    gru_simd, linear_simd, matmul,
};

/// Values between -0.5 and 0.5 without a generator: a low-discrepancy sequence.
pub fn values(n: usize) -> Vec<f32> {
    (0..n).map(|i| (i as f32 * 0.618_034).fract() - 0.5).collect()
}

/// Values that start on a cache line, as the tape's do.
#[derive(Debug)]
struct Aligned(Vec<f32>, usize);

impl Aligned {
    fn new(n: usize) -> Self {
        let memory = values(n + 16);
        let start = memory.as_ptr().align_offset(64).min(16);
        Aligned(memory, start)
    }
    fn get(&self) -> &[f32] {
        &self.0[self.1..self.0.len() - 16 + self.1]
    }
    fn get_mut(&mut self) -> &mut [f32] {
        let end = self.0.len() - 16 + self.1;
        &mut self.0[self.1..end]
    }
}

/// A large square matrix product: the rate that a core can reach.
#[derive(Debug)]
pub struct Product {
    n: usize,
    a: Vec<f32>,
    b: Vec<f32>,
    out: Vec<f32>,
}

impl Product {
    /// Of `n x n` matrices.
    pub fn new(n: usize) -> Self {
        Product { n, a: values(n * n), b: values(n * n), out: vec![0.0; n * n] }
    }

    /// Operations of a product.
    pub fn flops(&self) -> f64 {
        2.0 * (self.n as f64).powi(3)
    }

    /// One product, on this thread.
    pub fn run(&mut self) {
        let n = self.n;
        let dims = MatmulDims { m: n, k: n, n, a_transposed: false, b_transposed: false };
        matmul(dims, &self.a, &self.b, &mut self.out, false);
    }
}

/// A GRU layer with everything that its passes need.
#[derive(Debug)]
pub struct Gru {
    dims: GruDims,
    weights: [Vec<f32>; 4],
    grads: [Vec<f32>; 4],
    x: Aligned,
    y: Aligned,
    saved: Aligned,
    dy: Aligned,
    dx: Aligned,
    scratch: Aligned,
    wants_dx: bool,
}

impl Gru {
    /// A layer of the given extents; `wants_dx`: its input is no data but another layer's output.
    pub fn new(dims: GruDims, wants_dx: bool) -> Self {
        let GruDims { time, input, hidden, batch } = dims;
        let sizes = [3 * hidden * input, 3 * hidden * hidden, 3 * hidden, 3 * hidden];
        Gru {
            weights: sizes.map(values),
            grads: sizes.map(|n| vec![0.0; n]),
            x: Aligned::new(time * input * batch),
            y: Aligned::new(time * hidden * batch),
            saved: Aligned::new(4 * time * hidden * batch),
            dy: Aligned::new(time * hidden * batch),
            dx: Aligned::new(if wants_dx { time * input * batch } else { 0 }),
            scratch: Aligned::new(gru_simd::scratch(input, hidden)),
            wants_dx,
            dims,
        }
    }

    /// Operations of the forward pass.
    pub fn forward_flops(&self) -> f64 {
        let GruDims { time, input, hidden, batch } = self.dims;
        (2 * time * batch * 3 * hidden * (input + hidden)) as f64
    }

    /// Operations of the backward pass.
    pub fn backward_flops(&self) -> f64 {
        let GruDims { time, input, hidden, batch } = self.dims;
        (2 * time * batch * 3 * hidden * (input * (1 + usize::from(self.wants_dx)) + 2 * hidden)) as f64
    }

    /// Forward pass; `save`: keeps what the backward pass needs.
    pub fn forward(&mut self, save: bool) {
        let [w_ih, w_hh, b_ih, b_hh] = &self.weights;
        let weights = GruWeights { w_ih, w_hh, b_ih, b_hh };
        let saved = if save { self.saved.get_mut() } else { &mut [] };
        let (x, y) = (self.x.get(), self.y.get_mut());
        gru_simd::forward(
            GruForward { dims: self.dims, weights, x, h0: &[], y, saved },
            self.scratch.get_mut(),
        );
    }

    /// Backward pass.
    pub fn backward(&mut self) {
        let [w_ih, w_hh, b_ih, b_hh] = &self.weights;
        let [dw_ih, dw_hh, db_ih, db_hh] = &mut self.grads;
        let args = GruBackward {
            dims: self.dims,
            weights: GruWeights { w_ih, w_hh, b_ih, b_hh },
            x: self.x.get(),
            h0: &[],
            y: self.y.get(),
            saved: self.saved.get(),
            dy: self.dy.get(),
            dx: self.dx.get_mut(),
            dx_fresh: true,
            dx_inputs: self.dims.input,
            dh0: &mut [],
            dw_ih,
            dw_hh,
            db_ih,
            db_hh,
        };
        gru_simd::backward(args, self.scratch.get_mut());
    }
}

/// A linear layer over a sequence.
#[derive(Debug)]
pub struct Linear {
    dims: LinearDims,
    w: Vec<f32>,
    b: Vec<f32>,
    grads: [Vec<f32>; 2],
    x: Aligned,
    y: Aligned,
    dy: Aligned,
    dx: Aligned,
    scratch: Aligned,
}

impl Linear {
    /// A layer of the given extents.
    pub fn new(dims: LinearDims) -> Self {
        let LinearDims { time, input, output, batch } = dims;
        Linear {
            w: values(input * output),
            b: values(output),
            grads: [vec![0.0; input * output], vec![0.0; output]],
            x: Aligned::new(time * input * batch),
            y: Aligned::new(time * output * batch),
            dy: Aligned::new(time * output * batch),
            dx: Aligned::new(time * input * batch),
            scratch: Aligned::new(linear_simd::scratch(input, output)),
            dims,
        }
    }

    /// Operations of the forward pass; the backward pass has twice as many.
    pub fn forward_flops(&self) -> f64 {
        (2 * self.dims.time * self.dims.batch * self.dims.input * self.dims.output) as f64
    }

    /// Forward pass.
    pub fn forward(&mut self) {
        let (x, y) = (self.x.get(), self.y.get_mut());
        let args = LinearForward { dims: self.dims, w: &self.w, b: &self.b, x, y, tanh: false };
        linear_simd::forward(args, self.scratch.get_mut());
    }

    /// Backward pass.
    pub fn backward(&mut self) {
        let [dw, db] = &mut self.grads;
        let (x, dy, dx) = (self.x.get(), self.dy.get(), self.dx.get_mut());
        let args = LinearBackward { dims: self.dims, w: &self.w, x, y: &[], dy, dx, dx_fresh: true, dw, db };
        linear_simd::backward(args, self.scratch.get_mut());
    }
}
