//! GRU forward pass for four sequences.

use super::super::gates::{SIGMOID_SCALE, TANH_SCALE, sigmoids, tanhs};
use super::super::{GruForward, GruWeights};
use super::{QUAD, quads, repeat, vectors, vectors_mut, width};
use pulp::{Simd, f32x16, x86::V4};

/// Number of scratch elements that the forward pass needs: for weights, biases and the initial state.
pub(super) const fn scratch(input: usize, hidden: usize) -> usize {
    QUAD * hidden * (3 * (input + hidden) + 4 + 1)
}

/// Packs the weights, then runs all steps of the four sequences.
#[inline(always)]
pub(super) fn run(simd: V4, g: GruForward<'_, f32>, scratch: &mut [f32]) {
    let (time, input, hidden) = (g.dims.time, g.dims.input, g.dims.hidden);
    let (w_ih, remaining) = scratch.split_at_mut(QUAD * 3 * hidden * input);
    let (w_hh, remaining) = remaining.split_at_mut(QUAD * 3 * hidden * hidden);
    let (bias, remaining) = remaining.split_at_mut(QUAD * 4 * hidden);
    let h0 = &mut remaining[..QUAD * hidden];
    pack(w_ih, g.weights.w_ih, hidden, input);
    pack(w_hh, g.weights.w_hh, hidden, hidden);
    pack_bias(bias, g.weights, hidden);
    match g.h0.is_empty() {
        true => h0.fill(0.0),
        false => h0.copy_from_slice(g.h0),
    }
    let (h0, row) = (&*h0, QUAD * hidden);
    for t in 0..time {
        let (past, now) = g.y.split_at_mut(t * row);
        let h = if t == 0 { h0 } else { &past[(t - 1) * row..] };
        let saved = if g.saved.is_empty() { &mut [][..] } else { &mut g.saved[4 * t * row..][..4 * row] };
        let mut step =
            Step { w: [&*w_ih, &*w_hh], bias, x: &g.x[QUAD * t * input..][..QUAD * input], h, saved };
        step.run(simd, &mut now[..row]);
    }
}

/// Packs one weight matrix, scaled for the gates, as vectors `[group of rows][column][gate][row]`.
///
/// Each weight is replicated for the four sequences.
fn pack(packed: &mut [f32], w: &[f32], hidden: usize, columns: usize) {
    let (mut slots, mut first) = (packed.as_chunks_mut::<QUAD>().0.iter_mut(), 0);
    while first < hidden {
        let units = first..first + QUAD * width((hidden - first) / QUAD);
        for column in 0..columns {
            for (gate, scale) in [SIGMOID_SCALE, SIGMOID_SCALE, TANH_SCALE].into_iter().enumerate() {
                for (unit, slot) in units.clone().zip(&mut slots) {
                    *slot = [w[(gate * hidden + unit) * columns + column] * scale; QUAD];
                }
            }
        }
        first = units.end;
    }
}

/// Packs the biases of r, z, n (input part) and n (recurrent part), scaled for the gates.
fn pack_bias(packed: &mut [f32], w: GruWeights<'_, f32>, hidden: usize) {
    let slots = packed.as_chunks_mut::<QUAD>().0;
    for (unit, slot) in slots[..2 * hidden].iter_mut().enumerate() {
        *slot = [(w.b_ih[unit] + w.b_hh[unit]) * SIGMOID_SCALE; QUAD];
    }
    for (slot, b) in
        slots[2 * hidden..].iter_mut().zip(w.b_ih[2 * hidden..].iter().chain(&w.b_hh[2 * hidden..]))
    {
        *slot = [b * TANH_SCALE; QUAD];
    }
}

/// Operands of one time step.
struct Step<'a> {
    /// Packed weights of the inputs and of the hidden states.
    w: [&'a [f32]; 2],
    bias: &'a [f32],
    x: &'a [f32],
    h: &'a [f32],
    saved: &'a mut [f32],
}

impl Step<'_> {
    /// Computes the hidden state `now` after the step.
    #[inline(always)]
    fn run(&mut self, simd: V4, now: &mut [f32]) {
        let (rows, mut first) = (self.h.len() / (QUAD * QUAD), 0);
        while first < rows {
            let n = width(rows - first);
            match n {
                4 => self.group::<4>(simd, first, now),
                2 => self.group::<2>(simd, first, now),
                _ => self.group::<1>(simd, first, now),
            }
            first += n;
        }
    }

    /// Computes `N` vectors of the hidden state (four units each) from vector `first`, with all their gates.
    #[inline(always)]
    fn group<const N: usize>(&mut self, simd: V4, first: usize, now: &mut [f32]) {
        let h = vectors(self.h);
        let (rows, bias) = (h.len(), vectors(self.bias));
        let mut sums = [[simd.splat_f32s(0.0); N]; 4];
        for part in 0..4 {
            for j in 0..N {
                sums[part][j] = bias[part * rows + first + j];
            }
        }
        let [mut r, mut z, mut n, mut m] = sums;
        columns(simd, self.w[0], first, self.x, [&mut r, &mut z, &mut n]);
        columns(simd, self.w[1], first, self.h, [&mut r, &mut z, &mut m]);
        for j in 0..N {
            (r[j], z[j]) = sigmoids(simd, r[j], z[j]);
            n[j] = simd.mul_add_e_f32s(r[j], m[j], n[j]);
        }
        for j in (0..N).step_by(2) {
            let next = (j + 1).min(N - 1);
            (n[j], n[next]) = tanhs(simd, n[j], n[next]);
        }
        let (now, saved) = (vectors_mut(now), vectors_mut(self.saved));
        for j in 0..N {
            let row = first + j;
            now[row] = simd.mul_add_e_f32s(z[j], simd.sub_f32s(h[row], n[j]), n[j]);
            if !saved.is_empty() {
                saved[row] = r[j];
                saved[rows + row] = z[j];
                saved[2 * rows + row] = n[j];
                saved[3 * rows + row] = simd.mul_f32s(m[j], simd.splat_f32s(1.0 / TANH_SCALE));
            }
        }
    }
}

/// Adds products of packed weights and `v` to the sums of three gates, for `N` vectors from vector `first`.
#[inline(always)]
fn columns<const N: usize>(simd: V4, w: &[f32], first: usize, v: &[f32], sums: [&mut [f32x16; N]; 3]) {
    let v = quads(v);
    let w = vectors(w)[3 * v.len() * first..][..3 * v.len() * N].as_chunks::<N>().0.as_chunks::<3>().0;
    let [mut r, mut z, mut n] = [*sums[0], *sums[1], *sums[2]];
    for (w, v) in w.iter().zip(v) {
        let v = repeat(simd, *v);
        for j in 0..N {
            r[j] = simd.mul_add_e_f32s(w[0][j], v, r[j]);
            z[j] = simd.mul_add_e_f32s(w[1][j], v, z[j]);
            n[j] = simd.mul_add_e_f32s(w[2][j], v, n[j]);
        }
    }
    (*sums[0], *sums[1], *sums[2]) = (r, z, n);
}
