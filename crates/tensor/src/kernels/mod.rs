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

/// Extents of one GRU layer and of the sequences that it processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GruDims {
    /// Number of time steps T.
    pub time: usize,
    /// Number of input features I.
    pub input: usize,
    /// Number of hidden units H.
    pub hidden: usize,
    /// Number of sequences B in the batch.
    pub batch: usize,
}

/// Weights of one GRU layer in PyTorch's layout: H rows for each of the gates r, z, n.
#[derive(Debug, Clone, Copy)]
pub struct GruWeights<'a, T> {
    /// Input weights `[3H, I]` (H hidden units, I inputs).
    pub w_ih: &'a [T],
    /// Recurrent weights `[3H, H]` (H hidden units).
    pub w_hh: &'a [T],
    /// Input biases `[3H]` (H hidden units).
    pub b_ih: &'a [T],
    /// Recurrent biases `[3H]` (H hidden units).
    pub b_hh: &'a [T],
}

/// Operands of the GRU forward kernel.
#[derive(Debug)]
pub struct GruForward<'a, T> {
    /// Extents of the layer and the sequence.
    pub dims: GruDims,
    /// Weights of the layer.
    pub weights: GruWeights<'a, T>,
    /// Inputs `[T, I, B]`: T time steps, I features, B sequences.
    pub x: &'a [T],
    /// Initial hidden state `[H, B]` (H units, B sequences); empty means zero.
    pub h0: &'a [T],
    /// Output of the kernel: hidden states `[T, H, B]` (T time steps, H units, B sequences).
    pub y: &'a mut [T],
    /// Output for the vector-Jacobian product, `[T, 4H, B]`: gates r, z, n, and W_hn h + b_hn.
    ///
    /// Empty if no gradient is needed.
    pub saved: &'a mut [T],
}

/// Operands of the vector-Jacobian product of the GRU, which adds to every output.
///
/// Only a `dx` that is fresh is overwritten.
#[derive(Debug)]
pub struct GruBackward<'a, T> {
    /// Extents of the layer and the sequence.
    pub dims: GruDims,
    /// Weights of the layer.
    pub weights: GruWeights<'a, T>,
    /// Inputs of the forward pass `[T, I, B]`: T time steps, I features, B sequences.
    pub x: &'a [T],
    /// Initial hidden state `[H, B]` (H units, B sequences); empty means zero.
    pub h0: &'a [T],
    /// Hidden states that the forward pass returned, `[T, H, B]`.
    pub y: &'a [T],
    /// Gates that the forward pass stored in `saved`, `[T, 4H, B]`.
    pub saved: &'a [T],
    /// Gradient of the loss with respect to the hidden states y, `[T, H, B]`.
    pub dy: &'a [T],
    /// Gradient with respect to the inputs x, `[T, I, B]`; empty if it is not needed.
    pub dx: &'a mut [T],
    /// Whether the contents of `dx` are undefined, so that they must be overwritten and not added to.
    pub dx_fresh: bool,
    /// Number of first input features whose gradient is needed; `dx` is undefined for the others.
    pub dx_inputs: usize,
    /// Gradient with respect to the initial state h0, `[H, B]`; empty if it is not needed.
    pub dh0: &'a mut [T],
    /// Gradient with respect to the input weights w_ih, `[3H, I]`.
    pub dw_ih: &'a mut [T],
    /// Gradient with respect to the recurrent weights w_hh, `[3H, H]`.
    pub dw_hh: &'a mut [T],
    /// Gradient with respect to the input biases b_ih, `[3H]`.
    pub db_ih: &'a mut [T],
    /// Gradient with respect to the recurrent biases b_hh, `[3H]`.
    pub db_hh: &'a mut [T],
}

/// Extents of an affine map over the feature axis, and of the sequences that it processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinearDims {
    /// Number of time steps T.
    pub time: usize,
    /// Number of input features I.
    pub input: usize,
    /// Number of output features O.
    pub output: usize,
    /// Number of sequences B in the batch.
    pub batch: usize,
}

/// Operands of the affine map `y = W x + b` at each time and for each sequence.
#[derive(Debug)]
pub struct LinearForward<'a, T> {
    /// Extents of the map and the sequence.
    pub dims: LinearDims,
    /// Weights `[O, I]`: O outputs, I inputs.
    pub w: &'a [T],
    /// Biases `[O]` of the O outputs.
    pub b: &'a [T],
    /// Inputs `[T, I, B]`: T time steps, I features, B sequences.
    pub x: &'a [T],
    /// Output of the kernel, `[T, O, B]`: T time steps, O features, B sequences.
    pub y: &'a mut [T],
    /// Whether tanh is applied to the outputs of the affine map.
    pub tanh: bool,
}

/// Operands of the vector-Jacobian product of the affine map, which adds to every output.
///
/// Only a `dx` that is fresh is overwritten.
#[derive(Debug)]
pub struct LinearBackward<'a, T> {
    /// Extents of the map and the sequence.
    pub dims: LinearDims,
    /// Weights `[O, I]`: O outputs, I inputs.
    pub w: &'a [T],
    /// Inputs of the forward pass `[T, I, B]`: T time steps, I features, B sequences.
    pub x: &'a [T],
    /// Outputs of the forward pass `[T, O, B]` if tanh was applied to them; otherwise empty.
    pub y: &'a [T],
    /// Gradient of the loss with respect to the outputs y, `[T, O, B]`.
    pub dy: &'a [T],
    /// Gradient with respect to the inputs x, `[T, I, B]`; empty if it is not needed.
    pub dx: &'a mut [T],
    /// Whether the contents of `dx` are undefined, so that they must be overwritten and not added to.
    pub dx_fresh: bool,
    /// Gradient with respect to the weights w, `[O, I]`.
    pub dw: &'a mut [T],
    /// Gradient with respect to the biases b, `[O]`.
    pub db: &'a mut [T],
}
