//! Numerical kernels: plain loops on slices, no tape, no allocation.
//!
//! Each fast kernel has a plain reference twin ([`gru_reference`], [`linear_reference`]) that it is
//! compared with on random shapes. Kernels work on scratch memory handed in by the caller; a `scratch`
//! function beside each says how much.

pub mod activation;
pub mod draw;
mod exp2;
mod gates;
mod gru_backward;
mod gru_forward;
mod gru_packed;
#[cfg(target_arch = "x86_64")]
mod gru_quad;
pub mod gru_reference;
pub mod gru_simd;
pub(crate) mod lanes;
pub mod linear_reference;
pub mod linear_simd;
mod matmul;
pub mod normal;
mod outer;
mod panels;
pub mod pointwise;
pub mod pointwise_reference;
mod prefetch;
pub(crate) mod vector;

pub use gru_packed::PackedGru;
pub use matmul::{MatmulDims, matmul};

/// Extents of one GRU layer over a sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GruDims {
    /// Time steps T.
    pub time: usize,
    /// Input features I.
    pub input: usize,
    /// Hidden units H.
    pub hidden: usize,
    /// Sequences B.
    pub batch: usize,
}

/// Weights of one GRU layer in PyTorch's layout; rows are the gates r, z, n, H rows each.
#[derive(Debug, Clone, Copy)]
pub struct GruWeights<'a, T> {
    /// `[3H, I]`.
    pub w_ih: &'a [T],
    /// `[3H, H]`.
    pub w_hh: &'a [T],
    /// `[3H]`.
    pub b_ih: &'a [T],
    /// `[3H]`.
    pub b_hh: &'a [T],
}

/// Operands of the GRU forward kernel.
#[derive(Debug)]
pub struct GruForward<'a, T> {
    /// Extents.
    pub dims: GruDims,
    /// Weights.
    pub weights: GruWeights<'a, T>,
    /// Inputs `[T, I, B]`.
    pub x: &'a [T],
    /// Initial hidden state `[H, B]`; empty means zero.
    pub h0: &'a [T],
    /// Output: hidden states `[T, H, B]`.
    pub y: &'a mut [T],
    /// Output for the VJP: `[T, 4H, B]`, the gates r, z, n and the recurrent part W_hn h + b_hn of the
    /// candidate; empty when no gradient is wanted.
    pub saved: &'a mut [T],
}

/// Operands of the GRU VJP. Every output is accumulated into, but a fresh `dx`.
#[derive(Debug)]
pub struct GruBackward<'a, T> {
    /// Extents.
    pub dims: GruDims,
    /// Weights.
    pub weights: GruWeights<'a, T>,
    /// Inputs `[T, I, B]`.
    pub x: &'a [T],
    /// Initial hidden state `[H, B]`; empty means zero.
    pub h0: &'a [T],
    /// Hidden states of the forward pass `[T, H, B]`.
    pub y: &'a [T],
    /// Gates and candidate saved by the forward pass, `[T, 4H, B]`.
    pub saved: &'a [T],
    /// Gradient of the loss with respect to y `[T, H, B]`.
    pub dy: &'a [T],
    /// Gradient of x `[T, I, B]`; empty when not wanted.
    pub dx: &'a mut [T],
    /// `dx` holds nothing yet: it is written, not added to.
    pub dx_fresh: bool,
    /// Number of inputs, the first ones, of which the gradient is wanted. What `dx` holds of the others afterwards is anything.
    pub dx_inputs: usize,
    /// Gradient of h0 `[H, B]`; empty when not wanted.
    pub dh0: &'a mut [T],
    /// Gradient of w_ih `[3H, I]`.
    pub dw_ih: &'a mut [T],
    /// Gradient of w_hh `[3H, H]`.
    pub dw_hh: &'a mut [T],
    /// Gradient of b_ih `[3H]`.
    pub db_ih: &'a mut [T],
    /// Gradient of b_hh `[3H]`.
    pub db_hh: &'a mut [T],
}

/// Extents of a linear map over the feature axis of a sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinearDims {
    /// Time steps T.
    pub time: usize,
    /// Input features I.
    pub input: usize,
    /// Output features O.
    pub output: usize,
    /// Sequences B.
    pub batch: usize,
}

/// Operands of the linear forward kernel: `y = W x + b` at each time and for each sequence.
#[derive(Debug)]
pub struct LinearForward<'a, T> {
    /// Extents.
    pub dims: LinearDims,
    /// Weights `[O, I]`.
    pub w: &'a [T],
    /// Bias `[O]`.
    pub b: &'a [T],
    /// Inputs `[T, I, B]`.
    pub x: &'a [T],
    /// Outputs `[T, O, B]`.
    pub y: &'a mut [T],
    /// The outputs are tanh of the map.
    pub tanh: bool,
}

/// Operands of the linear VJP. Every output is accumulated into, but a fresh `dx`.
#[derive(Debug)]
pub struct LinearBackward<'a, T> {
    /// Extents.
    pub dims: LinearDims,
    /// Weights `[O, I]`.
    pub w: &'a [T],
    /// Inputs `[T, I, B]`.
    pub x: &'a [T],
    /// Outputs of the forward pass `[T, O, B]` where they are tanh of the map; empty where they are the map.
    pub y: &'a [T],
    /// Gradient of y `[T, O, B]`.
    pub dy: &'a [T],
    /// Gradient of x `[T, I, B]`; empty when not wanted.
    pub dx: &'a mut [T],
    /// `dx` holds nothing yet: it is written, not added to.
    pub dx_fresh: bool,
    /// Gradient of w `[O, I]`.
    pub dw: &'a mut [T],
    /// Gradient of b `[O]`.
    pub db: &'a mut [T],
}
