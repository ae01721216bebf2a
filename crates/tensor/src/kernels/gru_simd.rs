//! The GRU layer in SIMD lanes, f32. Twin: [`super::gru_reference`].
//!
//! Forward: for each vector of sequences and each step, units are computed four at a time with 16
//! accumulators (r, z, and the input and recurrent part of n). Backward: the data gradient goes step by
//! step; the weight gradient is accumulated per block of steps, while that block's gradients are still
//! in cache, in register tiles over (gate row, input column).

use super::lanes::{self, MAX_LANES, TILE, load, matvec, store, tiles};
use super::{GruBackward, GruDims, GruForward};
use pulp::{Arch, Simd, WithSimd};

/// Units computed together in the forward pass.
const UNITS: usize = 4;
/// Time steps per block of the weight gradient.
const BLOCK: usize = 8;

/// Scratch elements for layer extents `(input, hidden)`, enough for both passes.
pub fn scratch(input: usize, hidden: usize) -> usize {
    let groups = hidden.div_ceil(UNITS);
    let forward = groups * (3 * UNITS * (input + hidden) + 4 * UNITS);
    let forward_rows = input + 2 * groups * UNITS;
    let backward = TILE * 3 * hidden * (tiles(hidden) + tiles(input));
    let weight_rows = 3 * hidden * (input + hidden) + 4 * hidden;
    let backward_rows = 2 * hidden + BLOCK * (4 * hidden + input + hidden) + weight_rows;
    (forward + MAX_LANES * forward_rows).max(backward + MAX_LANES * backward_rows)
}

/// Forward pass.
pub fn forward(args: GruForward<'_, f32>, scratch: &mut [f32]) {
    Arch::new().dispatch(Forward(args, scratch));
}

/// Vector-Jacobian product; accumulates into every output.
pub fn backward(args: GruBackward<'_, f32>, scratch: &mut [f32]) {
    Arch::new().dispatch(Backward(args, scratch));
}

struct Forward<'a, 'b>(GruForward<'a, f32>, &'b mut [f32]);
struct Backward<'a, 'b>(GruBackward<'a, f32>, &'b mut [f32]);

/// Packs the rows of the gates r, z, n of `UNITS` units side by side: `[group][column][gate, unit]`.
fn pack_gates(packed: &mut [f32], w: &[f32], hidden: usize, columns: usize) {
    let (rows, _) = packed.as_chunks_mut::<{ 3 * UNITS }>();
    for (at, row) in rows.iter_mut().enumerate() {
        let (group, column) = (at / columns.max(1), at % columns.max(1));
        for (slot, v) in row.iter_mut().enumerate() {
            let (gate, unit) = (slot / UNITS, group * UNITS + slot % UNITS);
            *v = if unit < hidden { w[(gate * hidden + unit) * columns + column] } else { 0.0 };
        }
    }
}

impl WithSimd for Forward<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Forward(g, scratch) = self;
        let GruDims { time, input, hidden, batch } = g.dims;
        let groups = hidden.div_ceil(UNITS);
        let (w_ih, rest) = scratch.split_at_mut(groups * 3 * UNITS * input);
        let (w_hh, rest) = rest.split_at_mut(groups * 3 * UNITS * hidden);
        let (bias, rest) = rest.split_at_mut(groups * 4 * UNITS);
        pack_gates(w_ih, g.weights.w_ih, hidden, input);
        pack_gates(w_hh, g.weights.w_hh, hidden, hidden);
        let bias = bias.as_chunks_mut::<{ 4 * UNITS }>().0;
        for (group, bias) in bias.iter_mut().enumerate() {
            for (slot, b) in bias.iter_mut().enumerate() {
                let (part, unit) = (slot / UNITS, group * UNITS + slot % UNITS);
                let (ih, hh) = (g.weights.b_ih, g.weights.b_hh);
                *b = match part {
                    _ if unit >= hidden => 0.0,
                    0 | 1 => ih[part * hidden + unit] + hh[part * hidden + unit],
                    2 => ih[2 * hidden + unit],
                    _ => hh[2 * hidden + unit],
                };
            }
        }
        let w_ih = w_ih.as_chunks::<{ 3 * UNITS }>().0;
        let w_hh = w_hh.as_chunks::<{ 3 * UNITS }>().0;
        let (x, rest) = lanes::vectors::<S>(rest, input);
        let (h, rest) = lanes::vectors::<S>(rest, groups * UNITS);
        let (next, _) = lanes::vectors::<S>(rest, groups * UNITS);
        let zero = simd.splat_f32s(0.0);

        for c in (0..batch).step_by(lanes::lanes::<S>()) {
            let n = lanes::lanes::<S>().min(batch - c);
            h.fill(zero);
            if !g.h0.is_empty() {
                for (j, h) in h.iter_mut().enumerate().take(hidden) {
                    *h = load(simd, &g.h0[j * batch + c..][..n]);
                }
            }
            for t in 0..time {
                for (i, x) in x.iter_mut().enumerate() {
                    *x = load(simd, &g.x[(t * input + i) * batch + c..][..n]);
                }
                for group in 0..groups {
                    let b = &bias[group];
                    let splat = |from: usize| -> [S::f32s; UNITS] {
                        std::array::from_fn(|j| simd.splat_f32s(b[from * UNITS + j]))
                    };
                    let (mut r, mut z, mut ni, mut nh) = (splat(0), splat(1), splat(2), splat(3));
                    for (w, &x) in w_ih[group * input..][..input].iter().zip(x.iter()) {
                        for j in 0..UNITS {
                            r[j] = simd.mul_add_e_f32s(simd.splat_f32s(w[j]), x, r[j]);
                            z[j] = simd.mul_add_e_f32s(simd.splat_f32s(w[UNITS + j]), x, z[j]);
                            ni[j] = simd.mul_add_e_f32s(simd.splat_f32s(w[2 * UNITS + j]), x, ni[j]);
                        }
                    }
                    for (w, &h) in w_hh[group * hidden..][..hidden].iter().zip(h.iter()) {
                        for j in 0..UNITS {
                            r[j] = simd.mul_add_e_f32s(simd.splat_f32s(w[j]), h, r[j]);
                            z[j] = simd.mul_add_e_f32s(simd.splat_f32s(w[UNITS + j]), h, z[j]);
                            nh[j] = simd.mul_add_e_f32s(simd.splat_f32s(w[2 * UNITS + j]), h, nh[j]);
                        }
                    }
                    for j in 0..UNITS {
                        let unit = group * UNITS + j;
                        let r = super::activation::sigmoid_lanes(simd, r[j]);
                        let z = super::activation::sigmoid_lanes(simd, z[j]);
                        let cand = super::activation::tanh_lanes(simd, simd.mul_add_e_f32s(r, nh[j], ni[j]));
                        let new = simd.mul_add_e_f32s(z, simd.sub_f32s(h[unit], cand), cand);
                        next[unit] = new;
                        if unit < hidden {
                            store(simd, &mut g.y[(t * hidden + unit) * batch + c..][..n], new);
                            if !g.saved.is_empty() {
                                for (slot, v) in [r, z, cand, nh[j]].into_iter().enumerate() {
                                    let at = ((t * 4 + slot) * hidden + unit) * batch + c;
                                    store(simd, &mut g.saved[at..][..n], v);
                                }
                            }
                        }
                    }
                }
                h.copy_from_slice(next);
            }
        }
    }
}

impl WithSimd for Backward<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Backward(g, scratch) = self;
        let GruDims { time, input, hidden, batch } = g.dims;
        let rows = 3 * hidden;
        // Gradient rows are ordered n (input part), r, z, n (recurrent part), so that the rows that
        // multiply W_ih and those that multiply W_hh are both contiguous.
        let gate_of = |slot: usize| (slot + 2) % 3 * hidden;
        let (w_hh, rest) = scratch.split_at_mut(TILE * tiles(hidden) * rows);
        let (w_ih, rest) = rest.split_at_mut(TILE * tiles(input) * rows);
        lanes::pack(w_hh, hidden, rows, |k, row| g.weights.w_hh[row * hidden + k]);
        lanes::pack(w_ih, input, rows, |i, row| {
            g.weights.w_ih[(gate_of(row / hidden) + row % hidden) * input + i]
        });
        let (w_hh, w_ih) = (w_hh.as_chunks::<TILE>().0, w_ih.as_chunks::<TILE>().0);
        let (carry, rest) = lanes::vectors::<S>(rest, hidden);
        let (grads, rest) = lanes::vectors::<S>(rest, BLOCK * 4 * hidden);
        let (x, rest) = lanes::vectors::<S>(rest, BLOCK * input);
        let (before, rest) = lanes::vectors::<S>(rest, BLOCK * hidden);
        let (dw_ih, rest) = lanes::vectors::<S>(rest, rows * input);
        let (dw_hh, rest) = lanes::vectors::<S>(rest, rows * hidden);
        let (db, _) = lanes::vectors::<S>(rest, 4 * hidden);
        let (zero, one) = (simd.splat_f32s(0.0), simd.splat_f32s(1.0));
        dw_ih.fill(zero);
        dw_hh.fill(zero);
        db.fill(zero);

        for c in (0..batch).step_by(lanes::lanes::<S>()) {
            let n = lanes::lanes::<S>().min(batch - c);
            carry.fill(zero);
            let mut end = time;
            while end > 0 {
                let start = end.saturating_sub(BLOCK);
                let steps = end - start;
                for (at, x) in x.iter_mut().take(steps * input).enumerate() {
                    *x = load(simd, &g.x[(start * input + at) * batch + c..][..n]);
                }
                for s in 0..steps {
                    for (j, slot) in before[s * hidden..][..hidden].iter_mut().enumerate() {
                        *slot = match start + s {
                            0 if g.h0.is_empty() => zero,
                            0 => load(simd, &g.h0[j * batch + c..][..n]),
                            t => load(simd, &g.y[((t - 1) * hidden + j) * batch + c..][..n]),
                        };
                    }
                }
                for s in (0..steps).rev() {
                    let t = start + s;
                    let grads = &mut grads[s * 4 * hidden..][..4 * hidden];
                    let (d_n, d_rest) = grads.split_at_mut(hidden);
                    let (d_r, d_rest) = d_rest.split_at_mut(hidden);
                    let (d_z, d_m) = d_rest.split_at_mut(hidden);
                    for j in 0..hidden {
                        let at = |slot: usize| {
                            load(simd, &g.saved[((t * 4 + slot) * hidden + j) * batch + c..][..n])
                        };
                        let (r, z, cand, m) = (at(0), at(1), at(2), at(3));
                        let dy = load(simd, &g.dy[(t * hidden + j) * batch + c..][..n]);
                        let dh = simd.add_f32s(carry[j], dy);
                        let dh_z = simd.mul_f32s(dh, z);
                        // dh z (1 - z) (h - n), then dh (1 - z) (1 - n^2), and so on down the chain.
                        let not_z = simd.sub_f32s(one, z);
                        let diff = simd.sub_f32s(before[s * hidden + j], cand);
                        d_z[j] = simd.mul_f32s(simd.mul_f32s(dh_z, not_z), diff);
                        let slope = simd.sub_f32s(one, simd.mul_f32s(cand, cand));
                        let dn = simd.mul_f32s(simd.mul_f32s(dh, not_z), slope);
                        let dn_r = simd.mul_f32s(dn, r);
                        d_n[j] = dn;
                        d_m[j] = dn_r;
                        d_r[j] = simd.mul_f32s(simd.mul_f32s(dn_r, simd.sub_f32s(one, r)), m);
                        carry[j] = dh_z;
                    }
                    let recurrent = &grads[hidden..];
                    for tile in 0..tiles(hidden) {
                        let units = &mut carry[tile * TILE..];
                        let mut acc = [zero; TILE];
                        for (a, u) in acc.iter_mut().zip(units.iter()) {
                            *a = *u;
                        }
                        matvec(simd, &mut acc, &w_hh[tile * rows..][..rows], recurrent);
                        for (u, a) in units.iter_mut().zip(acc) {
                            *u = a;
                        }
                    }
                    if !g.dx.is_empty() {
                        for tile in 0..tiles(input) {
                            let mut acc = [zero; TILE];
                            matvec(simd, &mut acc, &w_ih[tile * rows..][..rows], grads);
                            let first = tile * TILE;
                            for (j, a) in acc.into_iter().enumerate().take(input - first) {
                                let row = &mut g.dx[(t * input + first + j) * batch + c..][..n];
                                let sum = simd.add_f32s(load(simd, row), a);
                                store(simd, row, sum);
                            }
                        }
                    }
                    for (b, d) in db.iter_mut().zip(grads.iter()) {
                        *b = simd.add_f32s(*b, *d);
                    }
                }
                lanes::outer(simd, dw_ih, (grads, 4 * hidden, rows), (x, input, input), steps);
                let recurrent = &grads[hidden..];
                lanes::outer(simd, dw_hh, (recurrent, 4 * hidden, rows), (before, hidden, hidden), steps);
                end = start;
            }
            if !g.dh0.is_empty() {
                for (j, v) in carry.iter().enumerate() {
                    let row = &mut g.dh0[j * batch + c..][..n];
                    let sum = simd.add_f32s(load(simd, row), *v);
                    store(simd, row, sum);
                }
            }
        }
        lanes::reduce_into(simd, g.dw_hh, dw_hh);
        lanes::reduce_into(simd, &mut g.db_hh[..], &db[hidden..]);
        for slot in 0..3 {
            let gate = gate_of(slot);
            let (w, b) = (&mut g.dw_ih[gate * input..], &mut g.db_ih[gate..]);
            lanes::reduce_into(simd, &mut w[..hidden * input], &dw_ih[slot * hidden * input..]);
            lanes::reduce_into(simd, &mut b[..hidden], &db[slot * hidden..]);
        }
    }
}
