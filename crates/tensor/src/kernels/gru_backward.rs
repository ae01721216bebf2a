//! Vector-Jacobian product of the GRU layer in SIMD lanes.
//!
//! The gradient of the state is propagated backwards step by step. The gradients of inputs and weights are
//! computed block by block of steps, while the gate gradients of the block are in cache. With dh the gradient
//! of the state after a step and the notation of [`super::gru_reference`], the gradients of the
//! pre-activations are
//!
//! ```text
//! (1)  da_z = dh (h - n) z (1 - z)
//! (2)  da_n = dh (1 - z) (1 - n²),   dc_n = r da_n
//! (3)  da_r = da_n c_n r (1 - r)
//! (4)  dh before the step = z dh + W_hhᵀ (da_r, da_z, dc_n)
//! ```

use super::lanes::{BLOCK, Chunk, MAX_LANES, reduce_into, rows_mut, vectors};
use super::outer::{Rows, outer, sums};
use super::panels::{InitialSum, Panels, packed_len};
use super::prefetch::prefetch;
use super::vector::Vector;
use super::{GruBackward, GruDims};
use crate::simd::Kernel;
use pulp::Simd;

/// Number of time steps ahead for which memory is prefetched.
const PREFETCH_STEPS: usize = 2;

/// Number of vectors from the gate gradients of one step to those of the next.
///
/// It is one more than the number of gradients: with a stride of a multiple of 4 KB, the same row of all
/// steps would fall into one set of the L1 cache.
const fn stride_of(hidden: usize) -> usize {
    4 * hidden + 1
}

/// Number of scratch elements that the backward pass of a layer needs.
pub(crate) fn scratch(input: usize, hidden: usize) -> usize {
    let rows = 3 * hidden;
    let packed = packed_len(hidden, rows) + packed_len(input, rows);
    let accumulators = rows * (input + hidden) + 4 * hidden;
    // Gate gradients; x and dx; y and dy; the saved gates.
    let block = BLOCK * (stride_of(hidden) + 2 * input + (2 + 4) * hidden);
    packed + MAX_LANES * (2 * hidden + accumulators + block)
}

/// Kernel of the backward pass: operands and scratch memory.
pub(crate) struct Backward<'a, 'b>(pub GruBackward<'a, f32>, pub &'b mut [f32]);

impl Kernel for Backward<'_, '_> {
    #[inline(always)]
    fn run<S: Vector, const MANY_REGISTERS: bool>(self, simd: S) {
        let Backward(g, scratch) = self;
        let GruDims { time, input, hidden, batch } = g.dims;
        if hidden == 0 {
            if g.dx_fresh {
                g.dx.fill(0.0);
            }
            return;
        }
        let rows = 3 * hidden;
        // Gate gradients are in the order a_n, r, z, c_n: those of the rows of W_ih are then contiguous, as
        // are those of the rows of W_hh.
        let (w_hh, remaining) = scratch.split_at_mut(packed_len(hidden, rows));
        let (w_ih, remaining) = remaining.split_at_mut(packed_len(input, rows));
        let w_hh =
            Panels::pack::<MANY_REGISTERS>(w_hh, hidden, rows, |k, row| g.weights.w_hh[row * hidden + k]);
        let wants_dx = !g.dx.is_empty() && g.dx_inputs > 0;
        let w_ih =
            Panels::pack::<MANY_REGISTERS>(w_ih, if wants_dx { g.dx_inputs } else { 0 }, rows, |i, row| {
                g.weights.w_ih[(gate_row(row / hidden, hidden) + row % hidden) * input + i]
            });
        let (carry, remaining) = vectors::<S>(remaining, hidden);
        let (h0, remaining) = vectors::<S>(remaining, hidden);
        let stride = stride_of(hidden);
        let (grads, remaining) = vectors::<S>(remaining, BLOCK * stride);
        let (x_buffer, remaining) = vectors::<S>(remaining, BLOCK * input);
        let (dx_buffer, remaining) = vectors::<S>(remaining, BLOCK * input);
        let (y_buffer, remaining) = vectors::<S>(remaining, BLOCK * hidden);
        let (dy_buffer, remaining) = vectors::<S>(remaining, BLOCK * hidden);
        let (saved_buffer, remaining) = vectors::<S>(remaining, BLOCK * 4 * hidden);
        let (dw_ih, remaining) = vectors::<S>(remaining, rows * input);
        let (dw_hh, remaining) = vectors::<S>(remaining, rows * hidden);
        let (db, _) = vectors::<S>(remaining, 4 * hidden);
        let zero = simd.splat_f32s(0.0);
        dw_ih.fill(zero);
        dw_hh.fill(zero);
        db.fill(zero);

        for chunk in Chunk::all::<S>(batch) {
            carry.fill(zero);
            h0.fill(zero);
            if !g.h0.is_empty() {
                h0.copy_from_slice(chunk.read(simd, g.h0, (0, hidden), y_buffer));
            }
            let mut end = time;
            while end > 0 {
                let start = (end - 1) / BLOCK * BLOCK;
                let steps = end - start;
                let x = chunk.read(simd, g.x, (start * input, steps * input), x_buffer);
                let previous = previous_states(simd, chunk, (g.y, h0), (start, steps), y_buffer, dy_buffer);
                let saved = chunk.read(simd, g.saved, (start * 4 * hidden, steps * 4 * hidden), saved_buffer);
                let dy = chunk.read(simd, g.dy, (start * hidden, steps * hidden), dy_buffer);
                let grads = &mut grads[..steps * stride];
                block_gradients::<S, MANY_REGISTERS>(simd, w_hh, carry, Block { previous, saved, dy }, grads);
                let grads = &*grads;
                if wants_dx {
                    let dx = InputGradient { dx: g.dx, is_fresh: g.dx_fresh, input, start, steps };
                    dx.compute::<S, MANY_REGISTERS>(simd, w_ih, chunk, grads, dx_buffer);
                }
                let part = |first, count| Rows { vectors: grads, stride, first, count };
                let x = Rows { vectors: x, stride: input, first: 0, count: input };
                let previous = Rows { vectors: previous, stride: hidden, first: 0, count: hidden };
                outer::<S, MANY_REGISTERS>(simd, dw_ih, part(0, rows), x, steps);
                outer::<S, MANY_REGISTERS>(simd, dw_hh, part(hidden, rows), previous, steps);
                sums(simd, db, part(0, 4 * hidden), steps);
                end = start;
            }
            if !g.dh0.is_empty() {
                chunk.add(simd, g.dh0, 0, carry);
            }
        }
        add_weight_gradients(simd, g, dw_ih, dw_hh, db);
    }
}

/// Hidden state before each of the `steps` steps from `start`: `h0` before step 0, else an output `y`.
///
/// It is a part of `y`, or is copied to `buffer`; `spare` is overwritten.
#[inline(always)]
fn previous_states<'a, S: Simd>(
    simd: S,
    chunk: Chunk,
    (y, h0): (&'a [f32], &[S::f32s]),
    (start, steps): (usize, usize),
    buffer: &'a mut [S::f32s],
    spare: &mut [S::f32s],
) -> &'a [S::f32s] {
    let hidden = h0.len();
    if start > 0 {
        return chunk.read(simd, y, ((start - 1) * hidden, steps * hidden), buffer);
    }
    let rows = (steps - 1) * hidden;
    let y = chunk.read(simd, y, (0, rows), spare);
    buffer[hidden..][..rows].copy_from_slice(y);
    buffer[..hidden].copy_from_slice(h0);
    &buffer[..steps * hidden]
}

/// First row of a gate in PyTorch's weights, by the gate's place in this kernel's order a_n, r, z.
pub(crate) const fn gate_row(slot: usize, hidden: usize) -> usize {
    (slot + 2) % 3 * hidden
}

/// Where and how the gradients with respect to the inputs of a block of steps are written.
struct InputGradient<'a> {
    dx: &'a mut [f32],
    is_fresh: bool,
    input: usize,
    start: usize,
    steps: usize,
}

impl InputGradient<'_> {
    /// Computes the gradients with respect to the inputs from the gate gradients of the block.
    #[inline(always)]
    fn compute<S: Simd, const MANY_REGISTERS: bool>(
        self,
        simd: S,
        w_ih: Panels<'_>,
        chunk: Chunk,
        grads: &[S::f32s],
        buffer: &mut [S::f32s],
    ) {
        let Self { dx, is_fresh, input, start, steps } = self;
        let (first_row, rows, stride) = (start * input, steps * input, grads.len() / steps);
        if chunk.is_whole::<S>() {
            let initial = if is_fresh { InitialSum::Zero } else { InitialSum::Output };
            let out = rows_mut::<S>(dx, first_row, rows);
            w_ih.apply::<S, MANY_REGISTERS>(simd, initial, (grads, stride), (out, input), steps);
            return;
        }
        let out = &mut buffer[..rows];
        w_ih.apply::<S, MANY_REGISTERS>(simd, InitialSum::Zero, (grads, stride), (out, input), steps);
        if is_fresh {
            chunk.write(simd, dx, first_row, out);
        } else {
            chunk.add(simd, dx, first_row, out);
        }
    }
}

/// Adds the accumulated gradients of weights and biases, summed over the SIMD lanes, to the outputs.
#[inline(always)]
fn add_weight_gradients<S: Simd>(
    simd: S,
    g: GruBackward<'_, f32>,
    dw_ih: &[S::f32s],
    dw_hh: &[S::f32s],
    db: &[S::f32s],
) {
    let GruDims { input, hidden, .. } = g.dims;
    reduce_into(simd, g.dw_hh, dw_hh);
    reduce_into(simd, &mut g.db_hh[..], &db[hidden..]);
    for slot in 0..3 {
        let gate = gate_row(slot, hidden);
        let (w, b) = (&mut g.dw_ih[gate * input..], &mut g.db_ih[gate..]);
        reduce_into(simd, &mut w[..hidden * input], &dw_ih[slot * hidden * input..]);
        reduce_into(simd, &mut b[..hidden], &db[slot * hidden..]);
    }
}

/// Operands from which the gate gradients of consecutive steps are computed.
#[derive(Clone, Copy)]
pub(crate) struct Block<'a, V> {
    /// Hidden state before each step.
    pub previous: &'a [V],
    /// Gates r, z, n and recurrent part c_n of each step, saved by the forward pass.
    pub saved: &'a [V],
    /// Gradient of the loss with respect to the output of each step (the state after it).
    pub dy: &'a [V],
}

/// Computes the gate gradients of a block of steps, from its last step to its first.
///
/// `carry` is the gradient of the state after the block and is replaced by that of the state before it.
#[inline(always)]
fn block_gradients<S: Simd, const MANY_REGISTERS: bool>(
    simd: S,
    w_hh: Panels<'_>,
    carry: &mut [S::f32s],
    block: Block<'_, S::f32s>,
    grads: &mut [S::f32s],
) {
    let hidden = carry.len();
    for s in (0..block.dy.len() / hidden).rev() {
        let step = Block {
            previous: &block.previous[s * hidden..][..hidden],
            saved: &block.saved[s * 4 * hidden..][..4 * hidden],
            dy: &block.dy[s * hidden..][..hidden],
        };
        let grads = &mut grads[s * stride_of(hidden)..][..4 * hidden];
        gate_gradients(simd, carry, step, grads);
        w_hh.apply::<S, MANY_REGISTERS>(simd, InitialSum::Output, (&grads[hidden..], 0), (carry, 0), 1);
    }
}

/// Computes the gate gradients (1) to (3) of one step, in the order a_n, r, z, c_n.
///
/// `carry` is the gradient of the state after the step and is replaced by the term z dh of (4). The vectors
/// may have any layout, if all operands have the same.
#[inline(always)]
pub(crate) fn gate_gradients<S: Simd>(
    simd: S,
    carry: &mut [S::f32s],
    step: Block<'_, S::f32s>,
    grads: &mut [S::f32s],
) {
    let (hidden, one) = (carry.len(), simd.splat_f32s(1.0));
    let (previous, dy) = (step.previous, step.dy);
    let (saved_r, saved) = step.saved.split_at(hidden);
    let (saved_z, saved) = saved.split_at(hidden);
    let (saved_n, saved_m) = saved.split_at(hidden);
    let (d_n, remaining) = grads.split_at_mut(hidden);
    let (d_r, remaining) = remaining.split_at_mut(hidden);
    let (d_z, d_m) = remaining.split_at_mut(hidden);
    for j in 0..hidden {
        let (r, z, n, m) = (saved_r[j], saved_z[j], saved_n[j], saved_m[j]);
        for row in [saved_r, saved_z, saved_n, saved_m] {
            prefetch(row[j..].as_ptr().wrapping_sub(4 * hidden * PREFETCH_STEPS));
        }
        for row in [previous, dy] {
            prefetch(row[j..].as_ptr().wrapping_sub(hidden * PREFETCH_STEPS));
        }
        let dh = simd.add_f32s(carry[j], dy[j]);
        let dh_z = simd.mul_f32s(dh, z);
        let dh_one_minus_z = simd.sub_f32s(dh, dh_z);
        d_z[j] = simd.mul_f32s(simd.mul_f32s(dh_one_minus_z, z), simd.sub_f32s(previous[j], n));
        let slope = simd.negate_mul_add_e_f32s(n, n, one);
        let dn = simd.mul_f32s(dh_one_minus_z, slope);
        let dn_r = simd.mul_f32s(dn, r);
        d_n[j] = dn;
        d_m[j] = dn_r;
        d_r[j] = simd.mul_f32s(simd.negate_mul_add_e_f32s(dn_r, r, dn_r), m);
        carry[j] = dh_z;
    }
}
