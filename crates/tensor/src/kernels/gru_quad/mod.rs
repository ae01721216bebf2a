//! The GRU layer for batches of four sequences in AVX-512. Reference: [`super::gru_reference`].
//!
//! A batch of 100 is split into six tiles of 16 and one of 4; with one sequence per lane, the last would use
//! a quarter of each vector. Here a vector holds four units of four sequences, which are contiguous in memory
//! (rows `[unit, sequence]`). Each weight is replicated for the four sequences, and each input is repeated
//! for the four units.

mod backward;
mod forward;
mod replicated;

use super::{GruBackward, GruDims, GruForward};
use crate::simd::Level;
use pulp::{Simd, WithSimd, cast, f32x16, x86::V4};

/// Number of sequences in a batch of these kernels.
const QUAD: usize = 4;

/// Whether these kernels can run a layer of these extents with this instruction set.
pub(super) fn supports(level: Level, dims: GruDims) -> bool {
    level == Level::V4 && dims.batch == QUAD && dims.hidden > 0 && dims.hidden.is_multiple_of(QUAD)
}

/// Number of scratch elements that a layer needs, enough for forward and backward pass.
pub(super) const fn scratch(input: usize, hidden: usize) -> usize {
    let (forward, backward) = (forward::scratch(input, hidden), backward::scratch(input, hidden));
    if forward > backward { forward } else { backward }
}

/// Runs the forward pass for four sequences; does nothing without AVX-512.
pub(super) fn forward(args: GruForward<'_, f32>, scratch: &mut [f32]) {
    if let Some(simd) = V4::try_new() {
        Simd::vectorize(simd, Forward(simd, args, scratch));
    }
}

/// Runs the vector-Jacobian product for four sequences; does nothing without AVX-512.
pub(super) fn backward(args: GruBackward<'_, f32>, scratch: &mut [f32]) {
    if let Some(simd) = V4::try_new() {
        Simd::vectorize(simd, Backward(simd, args, scratch));
    }
}

struct Forward<'a, 'b>(V4, GruForward<'a, f32>, &'b mut [f32]);
struct Backward<'a, 'b>(V4, GruBackward<'a, f32>, &'b mut [f32]);

impl WithSimd for Forward<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        forward::run(self.0, self.1, self.2);
    }
}

impl WithSimd for Backward<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        backward::run(self.0, self.1, self.2);
    }
}

/// Vector with one value of each of the four sequences, repeated four times.
#[inline(always)]
fn repeat(simd: V4, quad: [f32; QUAD]) -> f32x16 {
    cast(simd.avx512f._mm512_broadcast_f32x4(cast(quad)))
}

/// Views a slice as vectors of 16 floats; an incomplete vector at the end is left out.
#[inline(always)]
fn vectors(slice: &[f32]) -> &[f32x16] {
    V4::as_simd_f32s(slice).0
}

/// Views a mutable slice as vectors of 16 floats; an incomplete vector at the end is left out.
#[inline(always)]
fn vectors_mut(slice: &mut [f32]) -> &mut [f32x16] {
    V4::as_mut_simd_f32s(slice).0
}

/// Views a slice as rows of one value for each of the four sequences.
#[inline(always)]
fn quads(slice: &[f32]) -> &[[f32; QUAD]] {
    slice.as_chunks().0
}

/// Number of vectors that are computed together when `remaining` vectors are left.
const fn width(remaining: usize) -> usize {
    match remaining {
        4.. => 4,
        2.. => 2,
        _ => 1,
    }
}
