//! Affine map over the feature axis of a sequence, in plain loops.
//!
//! It is the reference for the SIMD kernel, and is used for `f64`.

use super::{LinearBackward, LinearForward};
use crate::Scalar;

/// Computes `y[t, o, b] = sum_i w[o, i] x[t, i, b] + bias[o]`, or tanh of it.
pub fn forward<T: Scalar>(g: LinearForward<'_, T>) {
    let d = g.dims;
    for t in 0..d.time {
        for o in 0..d.output {
            for b in 0..d.batch {
                let mut sum = g.b[o];
                for i in 0..d.input {
                    sum += g.w[o * d.input + i] * g.x[(t * d.input + i) * d.batch + b];
                }
                g.y[(t * d.output + o) * d.batch + b] = if g.tanh { sum.tanh() } else { sum };
            }
        }
    }
}

/// Computes the vector-Jacobian product of the affine map in plain loops; see [`LinearBackward`].
pub fn backward<T: Scalar>(g: LinearBackward<'_, T>) {
    if g.dx_fresh {
        g.dx.fill(T::ZERO);
    }
    let d = g.dims;
    for t in 0..d.time {
        for o in 0..d.output {
            for b in 0..d.batch {
                let index = (t * d.output + o) * d.batch + b;
                let slope = if g.y.is_empty() { T::ONE } else { T::ONE - g.y[index] * g.y[index] };
                let dy = g.dy[index] * slope;
                g.db[o] += dy;
                for i in 0..d.input {
                    let index = (t * d.input + i) * d.batch + b;
                    g.dw[o * d.input + i] += dy * g.x[index];
                    if !g.dx.is_empty() {
                        g.dx[index] += dy * g.w[o * d.input + i];
                    }
                }
            }
        }
    }
}
