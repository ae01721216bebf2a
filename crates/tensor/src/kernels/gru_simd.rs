//! The GRU layer in SIMD lanes, f32. Twin: [`super::gru_reference`].

use super::{GruBackward, GruForward, gru_backward, gru_forward};
use crate::simd::Level;

/// Scratch elements for layer extents `(input, hidden)`, enough for both passes.
pub fn scratch(input: usize, hidden: usize) -> usize {
    gru_forward::scratch(input, hidden).max(gru_backward::scratch(input, hidden))
}

/// Forward pass.
pub fn forward(args: GruForward<'_, f32>, scratch: &mut [f32]) {
    forward_at(Level::current(), args, scratch);
}

/// Forward pass at a given level.
pub fn forward_at(level: Level, args: GruForward<'_, f32>, scratch: &mut [f32]) {
    level.run(args.dims.batch, gru_forward::Forward(args, scratch));
}

/// Vector-Jacobian product; accumulates into every output but a fresh `dx`.
pub fn backward(args: GruBackward<'_, f32>, scratch: &mut [f32]) {
    backward_at(Level::current(), args, scratch);
}

/// Vector-Jacobian product at a given level.
pub fn backward_at(level: Level, args: GruBackward<'_, f32>, scratch: &mut [f32]) {
    level.run(args.dims.batch, gru_backward::Backward(args, scratch));
}
