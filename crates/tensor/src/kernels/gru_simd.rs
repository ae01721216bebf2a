//! The GRU layer in SIMD lanes, f32. Reference: [`super::gru_reference`].

#[cfg(target_arch = "x86_64")]
use super::gru_quad;
use super::{GruBackward, GruForward, gru_backward, gru_forward};
use crate::simd::Level;

/// Number of scratch elements that a layer needs, enough for forward and backward pass.
pub fn scratch(input: usize, hidden: usize) -> usize {
    let elements = gru_forward::scratch(input, hidden).max(gru_backward::scratch(input, hidden));
    #[cfg(target_arch = "x86_64")]
    let elements = elements.max(gru_quad::scratch(input, hidden));
    elements
}

/// Runs the forward pass of the GRU layer with the instruction set of this process.
pub fn forward(args: GruForward<'_, f32>, scratch: &mut [f32]) {
    forward_at(Level::current(), args, scratch);
}

/// Runs the forward pass of the GRU layer with a given instruction set.
pub fn forward_at(level: Level, args: GruForward<'_, f32>, scratch: &mut [f32]) {
    #[cfg(target_arch = "x86_64")]
    if gru_quad::supports(level, args.dims) {
        return gru_quad::forward(args, scratch);
    }
    level.run(args.dims.batch, gru_forward::Forward(args, scratch));
}

/// Computes the vector-Jacobian product with the instruction set of this process; see [`GruBackward`].
pub fn backward(args: GruBackward<'_, f32>, scratch: &mut [f32]) {
    backward_at(Level::current(), args, scratch);
}

/// Computes the vector-Jacobian product of the GRU layer with a given instruction set.
pub fn backward_at(level: Level, args: GruBackward<'_, f32>, scratch: &mut [f32]) {
    #[cfg(target_arch = "x86_64")]
    if gru_quad::supports(level, args.dims) {
        return gru_quad::backward(args, scratch);
    }
    level.run(args.dims.batch, gru_backward::Backward(args, scratch));
}
