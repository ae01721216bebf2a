//! GRU vector-Jacobian product for four sequences, in blocks of steps as in [`super::super::gru_backward`].

use super::super::GruBackward;
use super::super::gru_backward::{Block, gate_gradients, gate_row};
use super::super::lanes::BLOCK;
use super::super::outer::{Rows, outer, sums};
use super::replicated::{ReplicatedWeights, replicated_len};
use super::{QUAD, quads, repeat, vectors, vectors_mut};
use pulp::x86::V4;

/// Number of f32 lanes of a vector: four units of four sequences.
const VECTOR: usize = QUAD * QUAD;

/// Number of scratch elements that the backward pass of a layer needs.
///
/// They hold the weights; the carried gradient, the initial state and dx of one step; the gate gradients and
/// repeated inputs of a block; and the accumulators.
pub(super) const fn scratch(input: usize, hidden: usize) -> usize {
    let weights = replicated_len(hidden, 3 * hidden) + replicated_len(input, 3 * hidden);
    let state = 2 * QUAD * hidden + QUAD * input.next_multiple_of(QUAD);
    let block = BLOCK * (QUAD * 4 * hidden + VECTOR * (input + hidden));
    let accumulators = QUAD * (3 * hidden * (input + hidden) + 4 * hidden);
    weights + state + block + accumulators
}

/// Adds the gradients of all operands of the layer to the outputs.
#[inline(always)]
pub(super) fn run(simd: V4, g: GruBackward<'_, f32>, scratch: &mut [f32]) {
    let (time, input, hidden) = (g.dims.time, g.dims.input, g.dims.hidden);
    let (rows, row) = (hidden / QUAD, QUAD * hidden);
    // Gate gradients are in the order a_n, r, z, c_n, as in `gru_backward`.
    let needed = if g.dx.is_empty() { 0 } else { g.dx_inputs };
    let (w_hh, remaining) = scratch.split_at_mut(replicated_len(hidden, 3 * hidden));
    let (w_ih, remaining) = remaining.split_at_mut(replicated_len(input, 3 * hidden));
    let w_hh = ReplicatedWeights::pack(w_hh, hidden, 3 * hidden, |k, gate| g.weights.w_hh[gate * hidden + k]);
    let w_ih = ReplicatedWeights::pack(w_ih, needed, 3 * hidden, |i, gate| {
        g.weights.w_ih[(gate_row(gate / hidden, hidden) + gate % hidden) * input + i]
    });
    let (carry, remaining) = remaining.split_at_mut(row);
    let (h0, remaining) = remaining.split_at_mut(row);
    let (dx, remaining) = remaining.split_at_mut(QUAD * input.next_multiple_of(QUAD));
    let dx = &mut dx[..QUAD * needed.next_multiple_of(QUAD)];
    let (grads, remaining) = remaining.split_at_mut(BLOCK * 4 * row);
    let (x_repeated, remaining) = remaining.split_at_mut(BLOCK * VECTOR * input);
    let (h_repeated, remaining) = remaining.split_at_mut(BLOCK * VECTOR * hidden);
    let (dw_ih, remaining) = remaining.split_at_mut(QUAD * 3 * hidden * input);
    let (dw_hh, remaining) = remaining.split_at_mut(QUAD * 3 * hidden * hidden);
    let db = &mut remaining[..QUAD * 4 * hidden];
    for buffer in [&mut *carry, &mut *dw_ih, &mut *dw_hh, &mut *db] {
        buffer.fill(0.0);
    }
    match g.h0.is_empty() {
        true => h0.fill(0.0),
        false => h0.copy_from_slice(g.h0),
    }
    let mut end = time;
    while end > 0 {
        let start = (end - 1) / BLOCK * BLOCK;
        for t in (start..end).rev() {
            let previous = if t == 0 { &*h0 } else { &g.y[(t - 1) * row..][..row] };
            let grads = &mut grads[(t - start) * 4 * row..][..4 * row];
            let step = Block {
                previous: vectors(previous),
                saved: vectors(&g.saved[4 * t * row..][..4 * row]),
                dy: vectors(&g.dy[t * row..][..row]),
            };
            gate_gradients(simd, vectors_mut(carry), step, vectors_mut(grads));
            w_hh.add(simd, &grads[row..], vectors_mut(carry));
            if needed > 0 {
                let out = &mut g.dx[QUAD * t * input..][..QUAD * needed];
                if g.dx_fresh {
                    out.fill(0.0);
                }
                if needed.is_multiple_of(QUAD) {
                    w_ih.add(simd, &grads[..3 * row], vectors_mut(out));
                } else {
                    dx[..out.len()].copy_from_slice(out);
                    w_ih.add(simd, &grads[..3 * row], vectors_mut(dx));
                    out.copy_from_slice(&dx[..out.len()]);
                }
            }
            let step = t - start;
            repeat_rows(
                simd,
                &g.x[QUAD * t * input..][..QUAD * input],
                &mut x_repeated[VECTOR * step * input..],
            );
            repeat_rows(simd, previous, &mut h_repeated[VECTOR * step * hidden..]);
        }
        let steps = end - start;
        let part = |first, count| Rows { vectors: vectors(grads), stride: 4 * rows, first, count };
        let x = Rows { vectors: vectors(x_repeated), stride: input, first: 0, count: input };
        let h = Rows { vectors: vectors(h_repeated), stride: hidden, first: 0, count: hidden };
        outer::<V4, true>(simd, vectors_mut(dw_ih), part(0, 3 * rows), x, steps);
        outer::<V4, true>(simd, vectors_mut(dw_hh), part(rows, 3 * rows), h, steps);
        sums(simd, vectors_mut(db), part(0, 4 * rows), steps);
        end = start;
    }
    g.dh0.iter_mut().zip(&*carry).for_each(|(d, c)| *d += *c);
    reduce(g.dw_hh, dw_hh, hidden);
    reduce(g.db_hh, &db[row..], 1);
    for slot in 0..3 {
        let gate = gate_row(slot, hidden);
        reduce(&mut g.dw_ih[gate * input..][..hidden * input], &dw_ih[slot * row * input..], input);
        reduce(&mut g.db_ih[gate..][..hidden], &db[slot * row..], 1);
    }
}

/// Repeats each row of four sequences four times, to fill a vector.
#[inline(always)]
fn repeat_rows(simd: V4, rows: &[f32], to: &mut [f32]) {
    for (to, row) in vectors_mut(to).iter_mut().zip(quads(rows)) {
        *to = repeat(simd, *row);
    }
}

/// Adds accumulators `[row of four units][column]`, summed over the sequences, to `out [unit, column]`.
fn reduce(out: &mut [f32], accumulators: &[f32], columns: usize) {
    let rows = out.chunks_exact_mut((QUAD * columns).max(1));
    for (out, vectors) in rows.zip(accumulators.chunks_exact((VECTOR * columns).max(1))) {
        for (column, vector) in vectors.as_chunks::<VECTOR>().0.iter().enumerate() {
            for (unit, [a, b, c, d]) in vector.as_chunks::<QUAD>().0.iter().enumerate() {
                out[unit * columns + column] += (a + b) + (c + d);
            }
        }
    }
}
