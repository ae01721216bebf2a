//! Product of a matrix with rows of four sequences; each weight is replicated for the sequences.

use super::{QUAD, quads, repeat, vectors, width};
use pulp::{Simd, f32x16, x86::V4};

/// Number of independent partial sums of an output, which hide the latency of the multiply-adds.
const PARTIAL_SUMS: usize = 4;

/// Number of floats that the packed `outputs x inputs` weights take.
pub(super) const fn replicated_len(outputs: usize, inputs: usize) -> usize {
    outputs.next_multiple_of(QUAD) * inputs * QUAD
}

/// Packed weights `[group of rows][input][row of four outputs]`, padded with zeros.
#[derive(Clone, Copy)]
pub(super) struct ReplicatedWeights<'a> {
    packed: &'a [f32],
    inputs: usize,
}

impl<'a> ReplicatedWeights<'a> {
    /// Packs the weights that `weight(output, input)` returns.
    #[inline(always)]
    pub fn pack(
        packed: &'a mut [f32],
        outputs: usize,
        inputs: usize,
        weight: impl Fn(usize, usize) -> f32,
    ) -> Self {
        let (mut slots, mut first) = (packed.as_chunks_mut::<QUAD>().0.iter_mut(), 0);
        while first < outputs {
            let end = first + QUAD * width((outputs - first).div_ceil(QUAD));
            for input in 0..inputs {
                for (output, slot) in (first..end).zip(&mut slots) {
                    *slot = [if output < outputs { weight(output, input) } else { 0.0 }; QUAD];
                }
            }
            first = end;
        }
        ReplicatedWeights { packed, inputs }
    }

    /// Adds the products of the weights with `x` to `out`, one vector per row of four outputs.
    #[inline(always)]
    pub fn add(self, simd: V4, x: &[f32], out: &mut [f32x16]) {
        let mut first = 0;
        while first < out.len() {
            let n = width(out.len() - first);
            match n {
                4 => self.rows::<4>(simd, x, first, out),
                2 => self.rows::<2>(simd, x, first, out),
                _ => self.rows::<1>(simd, x, first, out),
            }
            first += n;
        }
    }

    /// Computes `N` vectors of four outputs each from vector `first`.
    #[inline(always)]
    fn rows<const N: usize>(self, simd: V4, x: &[f32], first: usize, out: &mut [f32x16]) {
        let x = &quads(x)[..self.inputs];
        let w = vectors(self.packed)[first * self.inputs..][..N * self.inputs].as_chunks::<N>().0;
        let mut sums = [[simd.splat_f32s(0.0); N]; PARTIAL_SUMS];
        let (w, w_remainder) = w.as_chunks::<PARTIAL_SUMS>();
        let (x, x_remainder) = x.as_chunks::<PARTIAL_SUMS>();
        for (w, x) in w.iter().zip(x) {
            for k in 0..PARTIAL_SUMS {
                let v = repeat(simd, x[k]);
                for j in 0..N {
                    sums[k][j] = simd.mul_add_e_f32s(w[k][j], v, sums[k][j]);
                }
            }
        }
        for (w, x) in w_remainder.iter().zip(x_remainder) {
            let v = repeat(simd, *x);
            for j in 0..N {
                sums[0][j] = simd.mul_add_e_f32s(w[j], v, sums[0][j]);
            }
        }
        for (j, out) in out[first..first + N].iter_mut().enumerate() {
            let (a, b) = (simd.add_f32s(sums[0][j], sums[1][j]), simd.add_f32s(sums[2][j], sums[3][j]));
            *out = simd.add_f32s(*out, simd.add_f32s(a, b));
        }
    }
}
