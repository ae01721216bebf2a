//! The GRU layer for four sequences in AVX-512. Twin: [`super::gru_reference`].
//!
//! A batch of 100 is six tiles of 16 and one of 4, on which whole vectors of sequences would waste three quarters.
//! Here a vector holds four units of all four sequences, which is how rows `[unit, sequence]` lie in memory.
//! Weights are spread out four times; an input, four sequences wide, is repeated for the four units.

mod backward;
mod forward;
mod spread;

use super::{GruBackward, GruDims, GruForward};
use crate::simd::Level;
use pulp::{Simd, WithSimd, cast, f32x16, x86::V4};

/// Sequences.
const QUAD: usize = 4;

/// Whether these kernels are made for a layer.
pub(super) fn suits(level: Level, dims: GruDims) -> bool {
    level == Level::V4 && dims.batch == QUAD && dims.hidden > 0 && dims.hidden.is_multiple_of(QUAD)
}

/// Scratch elements for layer extents `(input, hidden)`.
pub(super) const fn scratch(input: usize, hidden: usize) -> usize {
    let (forward, backward) = (forward::scratch(input, hidden), backward::scratch(input, hidden));
    if forward > backward { forward } else { backward }
}

/// Forward pass, if the machine has AVX-512.
pub(super) fn forward(args: GruForward<'_, f32>, scratch: &mut [f32]) {
    if let Some(simd) = V4::try_new() {
        Simd::vectorize(simd, Forward(simd, args, scratch));
    }
}

/// Vector-Jacobian product, if the machine has AVX-512.
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

/// One value of each sequence, four times.
#[inline(always)]
fn repeat(simd: V4, quad: [f32; QUAD]) -> f32x16 {
    cast(simd.avx512f._mm512_broadcast_f32x4(cast(quad)))
}

/// Whole vectors of a slice.
#[inline(always)]
fn vectors(of: &[f32]) -> &[f32x16] {
    V4::as_simd_f32s(of).0
}

/// Whole vectors of a slice.
#[inline(always)]
fn vectors_mut(of: &mut [f32]) -> &mut [f32x16] {
    V4::as_mut_simd_f32s(of).0
}

/// Rows of four sequences.
#[inline(always)]
fn quads(of: &[f32]) -> &[[f32; QUAD]] {
    of.as_chunks().0
}

/// Rows of vectors that are computed together when `rest` are left.
const fn width(rest: usize) -> usize {
    match rest {
        4.. => 4,
        2.. => 2,
        _ => 1,
    }
}
