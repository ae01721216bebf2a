//! Numerical kernels: loops on slices, without tape and without allocation.
//!
//! Each SIMD kernel has a reference implementation in plain loops ([`gru_reference`], [`linear_reference`],
//! [`pointwise_reference`]), with which it is compared on random shapes. The caller passes scratch memory;
//! the `scratch` function of a kernel returns its length.

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

/// Weights of one GRU layer in PyTorch's layout: H rows for each of the gates r, z, n.
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
    /// Output for the vector-Jacobian product, `[T, 4H, B]`: r, z, n and W_hn h + b_hn.
    ///
    /// Empty if no gradient is needed.
    pub saved: &'a mut [T],
}

/// Operands of the vector-Jacobian product of the GRU, which adds to every output.
///
/// Only a `dx` that is fresh is overwritten.
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
    /// `saved` of the forward pass, `[T, 4H, B]`.
    pub saved: &'a [T],
    /// Gradient of the loss with respect to y `[T, H, B]`.
    pub dy: &'a [T],
    /// Gradient of x `[T, I, B]`; empty if it is not needed.
    pub dx: &'a mut [T],
    /// Whether `dx` is undefined before, and is therefore overwritten.
    pub dx_fresh: bool,
    /// Number of leading inputs whose gradient is needed; `dx` is undefined for the others.
    pub dx_inputs: usize,
    /// Gradient of h0 `[H, B]`; empty if it is not needed.
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

/// Extents of an affine map over the feature axis of a sequence.
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

/// Operands of the affine map `y = W x + b` at each time and for each sequence.
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
    /// Whether tanh is applied to the outputs.
    pub tanh: bool,
}

/// Operands of the vector-Jacobian product of the affine map, which adds to every output.
///
/// Only a `dx` that is fresh is overwritten.
#[derive(Debug)]
pub struct LinearBackward<'a, T> {
    /// Extents.
    pub dims: LinearDims,
    /// Weights `[O, I]`.
    pub w: &'a [T],
    /// Inputs `[T, I, B]`.
    pub x: &'a [T],
    /// Outputs of the forward pass `[T, O, B]` if tanh was applied to them; empty otherwise.
    pub y: &'a [T],
    /// Gradient of y `[T, O, B]`.
    pub dy: &'a [T],
    /// Gradient of x `[T, I, B]`; empty if it is not needed.
    pub dx: &'a mut [T],
    /// Whether `dx` is undefined before, and is therefore overwritten.
    pub dx_fresh: bool,
    /// Gradient of w `[O, I]`.
    pub dw: &'a mut [T],
    /// Gradient of b `[O]`.
    pub db: &'a mut [T],
}
