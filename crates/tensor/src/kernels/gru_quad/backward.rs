//! Vector-Jacobian product, in blocks of steps as [`super::super::gru_backward`] takes it.

use super::super::GruBackward;
use super::super::gru_backward::{Block, gate_gradients};
use super::super::lanes::BLOCK;
use super::super::outer::{Rows, outer, sums};
use super::spread::{Spread, spread_len};
use super::{QUAD, quads, repeat, vectors, vectors_mut};
use pulp::x86::V4;

const VECTOR: usize = QUAD * QUAD;

/// Scratch elements for layer extents `(input, hidden)`: weights; carry, initial state and a step's dx; a block's gate
/// gradients and repeated inputs; accumulators.
pub(super) const fn scratch(input: usize, hidden: usize) -> usize {
    let weights = spread_len(hidden, 3 * hidden) + spread_len(input, 3 * hidden);
    let state = 2 * QUAD * hidden + QUAD * input.next_multiple_of(QUAD);
    let block = BLOCK * (QUAD * 4 * hidden + VECTOR * (input + hidden));
    let accumulators = QUAD * (3 * hidden * (input + hidden) + 4 * hidden);
    weights + state + block + accumulators
}

#[inline(always)]
pub(super) fn run(simd: V4, g: GruBackward<'_, f32>, scratch: &mut [f32]) {
    let (time, input, hidden) = (g.dims.time, g.dims.input, g.dims.hidden);
    let (rows, row) = (hidden / QUAD, QUAD * hidden);
    // Gate gradients are ordered n (input part), r, z, n (recurrent part), as for whole vectors of sequences.
    let gate_of = |slot: usize| (slot + 2) % 3 * hidden;
    let wanted = if g.dx.is_empty() { 0 } else { g.dx_inputs };
    let (w_hh, rest) = scratch.split_at_mut(spread_len(hidden, 3 * hidden));
    let (w_ih, rest) = rest.split_at_mut(spread_len(input, 3 * hidden));
    let w_hh = Spread::pack(w_hh, hidden, 3 * hidden, |k, gate| g.weights.w_hh[gate * hidden + k]);
    let w_ih = Spread::pack(w_ih, wanted, 3 * hidden, |i, gate| {
        g.weights.w_ih[(gate_of(gate / hidden) + gate % hidden) * input + i]
    });
    let (carry, rest) = rest.split_at_mut(row);
    let (h0, rest) = rest.split_at_mut(row);
    let (dx, rest) = rest.split_at_mut(QUAD * input.next_multiple_of(QUAD));
    let dx = &mut dx[..QUAD * wanted.next_multiple_of(QUAD)];
    let (grads, rest) = rest.split_at_mut(BLOCK * 4 * row);
    let (x_repeated, rest) = rest.split_at_mut(BLOCK * VECTOR * input);
    let (h_repeated, rest) = rest.split_at_mut(BLOCK * VECTOR * hidden);
    let (dw_ih, rest) = rest.split_at_mut(QUAD * 3 * hidden * input);
    let (dw_hh, rest) = rest.split_at_mut(QUAD * 3 * hidden * hidden);
    let db = &mut rest[..QUAD * 4 * hidden];
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
            let before = if t == 0 { &*h0 } else { &g.y[(t - 1) * row..][..row] };
            let grads = &mut grads[(t - start) * 4 * row..][..4 * row];
            let step = Block {
                before: vectors(before),
                saved: vectors(&g.saved[4 * t * row..][..4 * row]),
                dy: vectors(&g.dy[t * row..][..row]),
            };
            gate_gradients(simd, vectors_mut(carry), step, vectors_mut(grads));
            w_hh.add(simd, &grads[row..], vectors_mut(carry));
            if wanted > 0 {
                let out = &mut g.dx[QUAD * t * input..][..QUAD * wanted];
                if g.dx_fresh {
                    out.fill(0.0);
                }
                if wanted.is_multiple_of(QUAD) {
                    w_ih.add(simd, &grads[..3 * row], vectors_mut(out));
                } else {
                    dx[..out.len()].copy_from_slice(out);
                    w_ih.add(simd, &grads[..3 * row], vectors_mut(dx));
                    out.copy_from_slice(&dx[..out.len()]);
                }
            }
            let at = t - start;
            spread_out(
                simd,
                &g.x[QUAD * t * input..][..QUAD * input],
                &mut x_repeated[VECTOR * at * input..],
            );
            spread_out(simd, before, &mut h_repeated[VECTOR * at * hidden..]);
        }
        let steps = end - start;
        let part = |first, count| Rows { all: vectors(grads), stride: 4 * rows, first, count };
        let x = Rows { all: vectors(x_repeated), stride: input, first: 0, count: input };
        let h = Rows { all: vectors(h_repeated), stride: hidden, first: 0, count: hidden };
        outer::<V4, true>(simd, vectors_mut(dw_ih), part(0, 3 * rows), x, steps);
        outer::<V4, true>(simd, vectors_mut(dw_hh), part(rows, 3 * rows), h, steps);
        sums(simd, vectors_mut(db), part(0, 4 * rows), steps);
        end = start;
    }
    g.dh0.iter_mut().zip(&*carry).for_each(|(d, c)| *d += *c);
    reduce(g.dw_hh, dw_hh, hidden);
    reduce(g.db_hh, &db[row..], 1);
    for slot in 0..3 {
        let gate = gate_of(slot);
        reduce(&mut g.dw_ih[gate * input..][..hidden * input], &dw_ih[slot * row * input..], input);
        reduce(&mut g.db_ih[gate..][..hidden], &db[slot * row..], 1);
    }
}

/// Every row of four sequences as a vector.
#[inline(always)]
fn spread_out(simd: V4, rows: &[f32], to: &mut [f32]) {
    for (to, row) in vectors_mut(to).iter_mut().zip(quads(rows)) {
        *to = repeat(simd, *row);
    }
}

/// Adds the sums over the sequences of accumulators `[row of four units][column]` to `out [unit, column]`.
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
