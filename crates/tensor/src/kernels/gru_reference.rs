//! The GRU layer in plain loops: the reference for the SIMD kernel, and used for `f64`.
//!
//! It is that of PyTorch (`torch.nn.GRU`; Cho et al. 2014). With a = W_i x + b_i and c = W_h h + b_h, both
//! split into the gates r, z and n:
//!
//! ```text
//! (1)  r = sigmoid(a_r + c_r),   z = sigmoid(a_z + c_z),   n = tanh(a_n + r c_n)
//! (2)  h' = (1 - z) n + z h
//! ```

use super::{GruBackward, GruForward};
use crate::Scalar;

/// Number of scratch elements that a layer needs, enough for forward and backward pass.
pub fn scratch(_input: usize, hidden: usize) -> usize {
    6 * hidden
}

/// Runs the forward pass of the GRU layer in plain loops.
pub fn forward<T: Scalar>(g: GruForward<'_, T>, scratch: &mut [T]) {
    let (nt, ni, nh, nb) = (g.dims.time, g.dims.input, g.dims.hidden, g.dims.batch);
    let w = g.weights;
    let (h, next) = scratch[..2 * nh].split_at_mut(nh);
    for b in 0..nb {
        for (j, v) in h.iter_mut().enumerate() {
            *v = if g.h0.is_empty() { T::ZERO } else { g.h0[j * nb + b] };
        }
        for t in 0..nt {
            for j in 0..nh {
                let mut a = [w.b_ih[j], w.b_ih[nh + j], w.b_ih[2 * nh + j]];
                let mut c = [w.b_hh[j], w.b_hh[nh + j], w.b_hh[2 * nh + j]];
                for gate in 0..3 {
                    let row = gate * nh + j;
                    for i in 0..ni {
                        a[gate] += w.w_ih[row * ni + i] * g.x[(t * ni + i) * nb + b];
                    }
                    for (k, h) in h.iter().enumerate() {
                        c[gate] += w.w_hh[row * nh + k] * *h;
                    }
                }
                let r = (a[0] + c[0]).sigmoid();
                let z = (a[1] + c[1]).sigmoid();
                let n = (a[2] + r * c[2]).tanh();
                next[j] = n + z * (h[j] - n);
                g.y[(t * nh + j) * nb + b] = next[j];
                if !g.saved.is_empty() {
                    for (slot, v) in [r, z, n, c[2]].into_iter().enumerate() {
                        g.saved[((t * 4 + slot) * nh + j) * nb + b] = v;
                    }
                }
            }
            h.copy_from_slice(next);
        }
    }
}

/// Computes the vector-Jacobian product of the GRU layer in plain loops; see [`GruBackward`].
pub fn backward<T: Scalar>(g: GruBackward<'_, T>, scratch: &mut [T]) {
    if g.dx_fresh {
        g.dx.fill(T::ZERO);
    }
    let (nt, ni, nh, nb) = (g.dims.time, g.dims.input, g.dims.hidden, g.dims.batch);
    let w = g.weights;
    let (dh, remaining) = scratch[..6 * nh].split_at_mut(nh);
    let (carry, gates) = remaining.split_at_mut(nh);
    for b in 0..nb {
        carry.fill(T::ZERO);
        for t in (0..nt).rev() {
            for j in 0..nh {
                dh[j] = carry[j] + g.dy[(t * nh + j) * nb + b];
                let saved = |slot: usize| g.saved[((t * 4 + slot) * nh + j) * nb + b];
                let (r, z, n, c) = (saved(0), saved(1), saved(2), saved(3));
                let h = previous_state(&g, t, j, b);
                let dz = dh[j] * (h - n) * z * (T::ONE - z);
                let dn = dh[j] * (T::ONE - z) * (T::ONE - n * n);
                let dr = dn * c * r * (T::ONE - r);
                // Gradients of the pre-activations: r and z (the same for a and c), then a_n, then c_n.
                for (slot, v) in [dr, dz, dn, dn * r].into_iter().enumerate() {
                    gates[slot * nh + j] = v;
                }
                carry[j] = dh[j] * z;
            }
            for gate in 0..3 {
                for j in 0..nh {
                    let row = gate * nh + j;
                    let d_input = gates[row];
                    let d_hidden = if gate == 2 { gates[3 * nh + j] } else { d_input };
                    g.db_ih[row] += d_input;
                    g.db_hh[row] += d_hidden;
                    for i in 0..ni {
                        let index = (t * ni + i) * nb + b;
                        g.dw_ih[row * ni + i] += d_input * g.x[index];
                        if !g.dx.is_empty() {
                            g.dx[index] += d_input * w.w_ih[row * ni + i];
                        }
                    }
                    for (k, carry) in carry.iter_mut().enumerate() {
                        g.dw_hh[row * nh + k] += d_hidden * previous_state(&g, t, k, b);
                        *carry += d_hidden * w.w_hh[row * nh + k];
                    }
                }
            }
        }
        if !g.dh0.is_empty() {
            for (j, v) in carry.iter().enumerate() {
                g.dh0[j * nb + b] += *v;
            }
        }
    }
}

/// Value of hidden unit `j` of sequence `b` before step `t`.
fn previous_state<T: Scalar>(g: &GruBackward<'_, T>, t: usize, j: usize, b: usize) -> T {
    let (nh, nb) = (g.dims.hidden, g.dims.batch);
    match t {
        0 if g.h0.is_empty() => T::ZERO,
        0 => g.h0[j * nb + b],
        _ => g.y[((t - 1) * nh + j) * nb + b],
    }
}
