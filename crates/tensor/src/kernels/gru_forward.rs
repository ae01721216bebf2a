//! Forward pass of the GRU layer in SIMD lanes.
//!
//! Hidden units are computed in groups, with all their gates at once: 4 units have 16 accumulators (r, z, and
//! the input and recurrent parts of n). Weights are broadcast from memory. The equations are in
//! [`super::gru_reference`].

use super::gates::{SIGMOID_SCALE, TANH_SCALE, sigmoids, tanhs};
use super::lanes::{BLOCK, Chunk, MAX_LANES, rows_mut, vectors};
use super::prefetch::prefetch;
use super::vector::Vector;
use super::{GruDims, GruForward, GruWeights};
use crate::simd::Kernel;

/// Number of time steps ahead for which memory is prefetched.
const PREFETCH_STEPS: usize = 2;

/// Number of floats that the packed weights and biases of a layer take.
pub(crate) const fn packed_len(input: usize, hidden: usize) -> usize {
    hidden.next_multiple_of(4) * (3 * (input + hidden) + 4)
}

/// Number of scratch elements that the forward pass of a layer with packed weights needs.
pub(crate) const fn scratch_packed(input: usize, hidden: usize) -> usize {
    MAX_LANES * (hidden + BLOCK * (input + 5 * hidden))
}

/// Number of scratch elements that the forward pass of a layer needs, packed weights included.
pub(crate) const fn scratch(input: usize, hidden: usize) -> usize {
    packed_len(input, hidden) + scratch_packed(input, hidden)
}

/// Kernel that packs weights for [`Sequence`]; the layout depends on the instruction set.
pub(crate) struct Pack<'a, 'b>(pub GruWeights<'a, f32>, pub GruDims, pub &'b mut [f32]);

impl Kernel for Pack<'_, '_> {
    #[inline(always)]
    fn run<S: Vector, const MANY_REGISTERS: bool>(self, _: S) {
        if MANY_REGISTERS { pack::<4>(self.0, self.1, self.2) } else { pack::<2>(self.0, self.1, self.2) }
    }
}

/// Kernel of the forward pass: packs the weights, then runs the sequence; operands and scratch memory.
pub(crate) struct Forward<'a, 'b>(pub GruForward<'a, f32>, pub &'b mut [f32]);

impl Kernel for Forward<'_, '_> {
    #[inline(always)]
    fn run<S: Vector, const MANY_REGISTERS: bool>(self, simd: S) {
        let Forward(GruForward { dims, weights, x, h0, y, saved }, scratch) = self;
        let (packed, scratch) = scratch.split_at_mut(packed_len(dims.input, dims.hidden));
        Pack(weights, dims, packed).run::<S, MANY_REGISTERS>(simd);
        Sequence { dims, packed, x, h0, y, saved, state: &mut [], scratch }.run::<S, MANY_REGISTERS>(simd);
    }
}

/// Kernel of the forward pass over a sequence with packed weights; see [`GruForward`].
pub(crate) struct Sequence<'a> {
    pub dims: GruDims,
    pub packed: &'a [f32],
    pub x: &'a [f32],
    pub h0: &'a [f32],
    pub y: &'a mut [f32],
    pub saved: &'a mut [f32],
    /// Hidden state `[H, B]`: before the sequence (replaces `h0`), and after it when the kernel returns; may
    /// be empty.
    pub state: &'a mut [f32],
    pub scratch: &'a mut [f32],
}

impl Kernel for Sequence<'_> {
    #[inline(always)]
    fn run<S: Vector, const MANY_REGISTERS: bool>(self, simd: S) {
        if MANY_REGISTERS { run::<S, 4>(simd, self) } else { run::<S, 2>(simd, self) }
    }
}

/// Packed weights in groups of `U` units, scaled for [`super::gates`].
///
/// Weights are `[group][column][gate][unit]`, biases `[group][part][unit]` with the parts r, z, n (input) and
/// n (recurrent).
struct Packed<'a, const U: usize> {
    w_ih: &'a [[[f32; U]; 3]],
    w_hh: &'a [[[f32; U]; 3]],
    bias: &'a [[[f32; U]; 4]],
}

/// Packs one weight matrix; units beyond `hidden` get zeros.
fn pack_columns<const U: usize>(packed: &mut [f32], w: &[f32], hidden: usize, columns: usize) {
    for (position, row) in packed.as_chunks_mut::<U>().0.as_chunks_mut::<3>().0.iter_mut().enumerate() {
        let (group, column) = (position / columns.max(1), position % columns.max(1));
        for (gate, row) in row.iter_mut().enumerate() {
            let scale = if gate == 2 { TANH_SCALE } else { SIGMOID_SCALE };
            for (j, v) in row.iter_mut().enumerate() {
                let unit = group * U + j;
                let exists = unit < hidden;
                *v = if exists { w[(gate * hidden + unit) * columns + column] * scale } else { 0.0 };
            }
        }
    }
}

/// Packs the weights and biases of a layer.
fn pack<const U: usize>(w: GruWeights<'_, f32>, d: GruDims, packed: &mut [f32]) {
    let units = d.hidden.next_multiple_of(U);
    let (w_ih, remaining) = packed.split_at_mut(3 * units * d.input);
    let (w_hh, remaining) = remaining.split_at_mut(3 * units * d.hidden);
    pack_columns::<U>(w_ih, w.w_ih, d.hidden, d.input);
    pack_columns::<U>(w_hh, w.w_hh, d.hidden, d.hidden);
    for (position, v) in remaining[..4 * units].iter_mut().enumerate() {
        let (part, unit) = (position / U % 4, position / (4 * U) * U + position % U);
        let bias = |gate: usize, b: &[f32]| b[gate * d.hidden + unit];
        *v = match part {
            _ if unit >= d.hidden => 0.0,
            0 | 1 => (bias(part, w.b_ih) + bias(part, w.b_hh)) * SIGMOID_SCALE,
            2 => bias(2, w.b_ih) * TANH_SCALE,
            _ => bias(2, w.b_hh) * TANH_SCALE,
        };
    }
}

impl<'a, const U: usize> Packed<'a, U> {
    /// Splits packed weights into their parts.
    fn view(packed: &'a [f32], d: GruDims) -> Self {
        let units = d.hidden.next_multiple_of(U);
        let (w_ih, remaining) = packed.split_at(3 * units * d.input);
        let (w_hh, remaining) = remaining.split_at(3 * units * d.hidden);
        Packed {
            w_ih: w_ih.as_chunks::<U>().0.as_chunks::<3>().0,
            w_hh: w_hh.as_chunks::<U>().0.as_chunks::<3>().0,
            bias: remaining[..4 * units].as_chunks::<U>().0.as_chunks::<4>().0,
        }
    }
}

/// Runs all sequences, one chunk of the batch and one block of steps after the other.
#[inline(always)]
fn run<S: Vector, const U: usize>(simd: S, g: Sequence<'_>) {
    let GruDims { time, input, hidden, batch } = g.dims;
    let packed = Packed::<U>::view(g.packed, g.dims);
    let (h, remaining) = vectors::<S>(g.scratch, hidden);
    let (x_buffer, remaining) = vectors::<S>(remaining, BLOCK * input);
    let (y_buffer, remaining) = vectors::<S>(remaining, BLOCK * hidden);
    let (saved_buffer, _) = vectors::<S>(remaining, BLOCK * 4 * hidden);
    let saves = !g.saved.is_empty();

    for chunk in Chunk::all::<S>(batch) {
        h.fill(simd.splat_f32s(0.0));
        let initial = if g.state.is_empty() { g.h0 } else { &*g.state };
        if !initial.is_empty() {
            h.copy_from_slice(chunk.read(simd, initial, (0, hidden), y_buffer));
        }
        for start in (0..time).step_by(BLOCK) {
            let steps = BLOCK.min(time - start);
            let x = chunk.read(simd, g.x, (start * input, steps * input), x_buffer);
            let saved_rows = if saves { steps * 4 * hidden } else { 0 };
            if chunk.is_whole::<S>() {
                let y = rows_mut::<S>(g.y, start * hidden, steps * hidden);
                let saved = rows_mut::<S>(g.saved, if saves { start * 4 * hidden } else { 0 }, saved_rows);
                block(simd, &packed, (x, input), h, y, saved);
            } else {
                let (y, saved) = (&mut y_buffer[..steps * hidden], &mut saved_buffer[..saved_rows]);
                block(simd, &packed, (x, input), h, y, saved);
                chunk.write(simd, g.y, start * hidden, y);
                chunk.write(simd, g.saved, start * 4 * hidden, saved);
            }
        }
        if !g.state.is_empty() {
            chunk.write(simd, g.state, 0, h);
        }
    }
}

/// Runs a block of steps; `h` is the hidden state before it and is replaced by the state after it.
#[inline(always)]
fn block<S: Vector, const U: usize>(
    simd: S,
    packed: &Packed<'_, U>,
    (x, input): (&[S::f32s], usize),
    h: &mut [S::f32s],
    y: &mut [S::f32s],
    saved: &mut [S::f32s],
) {
    let hidden = h.len();
    if hidden == 0 {
        return;
    }
    let steps = y.len() / hidden;
    for s in 0..steps {
        let (past, now) = y.split_at_mut(s * hidden);
        let previous = if s == 0 { &*h } else { &past[(s - 1) * hidden..] };
        let saved = if saved.is_empty() { &mut [][..] } else { &mut saved[s * 4 * hidden..][..4 * hidden] };
        step(simd, packed, &x[s * input..][..input], previous, &mut now[..hidden], saved);
    }
    h.copy_from_slice(&y[(steps - 1) * hidden..]);
}

/// Computes the hidden state `now` after one step from the hidden state `h` before it.
#[inline(always)]
fn step<S: Vector, const U: usize>(
    simd: S,
    packed: &Packed<'_, U>,
    x: &[S::f32s],
    h: &[S::f32s],
    now: &mut [S::f32s],
    saved: &mut [S::f32s],
) {
    let (input, hidden) = (x.len(), h.len());
    for (group, bias) in packed.bias.iter().enumerate() {
        let splat = |part: usize| -> [S::f32s; U] { std::array::from_fn(|j| simd.splat_f32s(bias[part][j])) };
        let (mut r, mut z, mut ni, mut nh) = (splat(0), splat(1), splat(2), splat(3));
        for (w, &x) in packed.w_ih[group * input..][..input].iter().zip(x) {
            for j in 0..U {
                r[j] = simd.mul_add_e_f32s(simd.splat_f32s(w[0][j]), x, r[j]);
                z[j] = simd.mul_add_e_f32s(simd.splat_f32s(w[1][j]), x, z[j]);
                ni[j] = simd.mul_add_e_f32s(simd.splat_f32s(w[2][j]), x, ni[j]);
            }
        }
        for (w, &h) in packed.w_hh[group * hidden..][..hidden].iter().zip(h) {
            for j in 0..U {
                r[j] = simd.mul_add_e_f32s(simd.splat_f32s(w[0][j]), h, r[j]);
                z[j] = simd.mul_add_e_f32s(simd.splat_f32s(w[1][j]), h, z[j]);
                nh[j] = simd.mul_add_e_f32s(simd.splat_f32s(w[2][j]), h, nh[j]);
            }
        }
        for j in 0..U {
            (r[j], z[j]) = sigmoids(simd, r[j], z[j]);
        }
        for j in 0..U {
            ni[j] = simd.mul_add_e_f32s(r[j], nh[j], ni[j]);
        }
        for j in (0..U).step_by(2) {
            (ni[j], ni[j + 1]) = tanhs(simd, ni[j], ni[j + 1]);
        }
        let first = group * U;
        for j in 0..U.min(hidden - first) {
            let unit = first + j;
            now[unit] = simd.mul_add_e_f32s(z[j], simd.sub_f32s(h[unit], ni[j]), ni[j]);
            if !saved.is_empty() {
                for part in 0..4 {
                    prefetch(
                        saved[part * hidden + unit..].as_ptr().wrapping_add(4 * hidden * PREFETCH_STEPS),
                    );
                }
                prefetch(now[unit..].as_ptr().wrapping_add(hidden * PREFETCH_STEPS));
                saved[unit] = r[j];
                saved[hidden + unit] = z[j];
                saved[2 * hidden + unit] = ni[j];
                saved[3 * hidden + unit] = simd.mul_f32s(nh[j], simd.splat_f32s(1.0 / TANH_SCALE));
            }
        }
    }
}
