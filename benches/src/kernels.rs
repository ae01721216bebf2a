//! Kernels with operands of given sizes, for the roofline table and the criterion benches.

use augsim_tensor::kernels::{
    GruBackward, GruDims, GruForward, GruWeights, LinearBackward, LinearDims, LinearForward, MatmulDims,
    gru_simd, linear_simd, matmul,
};

/// `n` deterministic values between -0.5 and 0.5, from a low-discrepancy sequence.
pub fn values(n: usize) -> Vec<f32> {
    (0..n).map(|i| (i as f32 * 0.618_034).fract() - 0.5).collect()
}

/// A buffer that starts on a cache line, like the buffers of the automatic-differentiation tape.
#[derive(Debug)]
struct Aligned {
    memory: Vec<f32>,
    /// Index of the first element that is on a cache line boundary.
    start: usize,
}

impl Aligned {
    fn new(n: usize) -> Self {
        let memory = values(n + 16);
        let start = memory.as_ptr().align_offset(64).min(16);
        Aligned { memory, start }
    }
    fn get(&self) -> &[f32] {
        &self.memory[self.start..self.memory.len() - 16 + self.start]
    }
    fn get_mut(&mut self) -> &mut [f32] {
        let end = self.memory.len() - 16 + self.start;
        &mut self.memory[self.start..end]
    }
}

/// A large square matrix product, whose rate is taken as the peak rate of a core.
#[derive(Debug)]
pub struct Product {
    n: usize,
    a: Vec<f32>,
    b: Vec<f32>,
    out: Vec<f32>,
}

impl Product {
    /// A product of two `n x n` matrices.
    pub fn new(n: usize) -> Self {
        Product { n, a: values(n * n), b: values(n * n), out: vec![0.0; n * n] }
    }

    /// Number of floating-point operations of one product.
    pub fn flops(&self) -> f64 {
        2.0 * (self.n as f64).powi(3)
    }

    /// Computes the matrix product once on this thread.
    pub fn run(&mut self) {
        let n = self.n;
        let dims = MatmulDims { m: n, k: n, n, a_transposed: false, b_transposed: false };
        matmul(dims, &self.a, &self.b, &mut self.out, false);
    }
}

/// A GRU layer with the buffers of its forward and backward pass, for timing.
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
    needs_input_gradient: bool,
}

impl Gru {
    /// A GRU layer with these sizes.
    ///
    /// `needs_input_gradient` is true for a layer whose input is the output of another layer instead of data.
    pub fn new(dims: GruDims, needs_input_gradient: bool) -> Self {
        let GruDims { time, input, hidden, batch } = dims;
        let sizes = [3 * hidden * input, 3 * hidden * hidden, 3 * hidden, 3 * hidden];
        Gru {
            weights: sizes.map(values),
            grads: sizes.map(|n| vec![0.0; n]),
            x: Aligned::new(time * input * batch),
            y: Aligned::new(time * hidden * batch),
            saved: Aligned::new(4 * time * hidden * batch),
            dy: Aligned::new(time * hidden * batch),
            dx: Aligned::new(if needs_input_gradient { time * input * batch } else { 0 }),
            scratch: Aligned::new(gru_simd::scratch(input, hidden)),
            needs_input_gradient,
            dims,
        }
    }

    /// Number of floating-point operations of the GRU layer's forward pass.
    pub fn forward_flops(&self) -> f64 {
        let GruDims { time, input, hidden, batch } = self.dims;
        (2 * time * batch * 3 * hidden * (input + hidden)) as f64
    }

    /// Number of floating-point operations of the GRU layer's backward pass.
    pub fn backward_flops(&self) -> f64 {
        let GruDims { time, input, hidden, batch } = self.dims;
        (2 * time * batch * 3 * hidden * (input * (1 + usize::from(self.needs_input_gradient)) + 2 * hidden))
            as f64
    }

    /// Runs the GRU layer's forward pass; `save` keeps what the backward pass needs.
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

    /// Runs the GRU layer's backward pass.
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

/// A linear layer over a sequence with its buffers, for timing.
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
    /// A linear layer with these sizes.
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

    /// Number of floating-point operations of the forward pass; the backward pass has twice as many.
    pub fn forward_flops(&self) -> f64 {
        (2 * self.dims.time * self.dims.batch * self.dims.input * self.dims.output) as f64
    }

    /// Runs the linear layer's forward pass.
    pub fn forward(&mut self) {
        let (x, y) = (self.x.get(), self.y.get_mut());
        let args = LinearForward { dims: self.dims, w: &self.w, b: &self.b, x, y, tanh: false };
        linear_simd::forward(args, self.scratch.get_mut());
    }

    /// Runs the linear layer's backward pass.
    pub fn backward(&mut self) {
        let [dw, db] = &mut self.grads;
        let (x, dy, dx) = (self.x.get(), self.dy.get(), self.dx.get_mut());
        let args = LinearBackward { dims: self.dims, w: &self.w, x, y: &[], dy, dx, dx_fresh: true, dw, db };
        linear_simd::backward(args, self.scratch.get_mut());
    }
}
