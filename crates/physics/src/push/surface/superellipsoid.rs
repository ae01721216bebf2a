//! The superellipsoidal limit surface `|f|^p + |m/c|^p = 1`.
//!
//! With p = 2 it is the ellipsoid. With p = 1.70 and the `c` of uniform pressure it is within 1 % of the
//! exact surface of a square.

use crate::Scalar;
use crate::push::planar::{Vector, Wrench, norm, scale};

/// Friction wrench of the superellipsoid against a twist: the gradient of its dissipation `D`.
///
/// `D = (|v|^q + |c ω|^q)^(1/q)`, `q = p/(p-1)`.
///
/// Zero at rest. Both speeds are divided by the larger one before powers are taken, against overflow and
/// underflow.
pub fn wrench<S: Scalar>(c: S, p: S, velocity: Vector<S>, rotation: S) -> Wrench<S> {
    let speed = norm(velocity);
    let turning = c * rotation.abs();
    let largest = if speed.value() > turning.value() { speed } else { turning };
    if largest.value() <= 0.0 {
        return Wrench::zero();
    }
    let one = S::constant(1.0);
    let q = p / (p + -1.0);
    let (a, b) = (speed / largest, turning / largest);
    let dissipation = power(power(a, q) + power(b, q), one / q);
    let exponent = q + -1.0;
    let force = if speed.value() > 0.0 {
        scale(velocity, power(a / dissipation, exponent) / speed)
    } else {
        [S::zero(); 2]
    };
    let moment = c * power(b / dissipation, exponent);
    Wrench { force, moment: if rotation.value() < 0.0 { -moment } else { moment } }
}

/// The power `x^e` for `x >= 0` and `e > 0`.
fn power<S: Scalar>(x: S, e: S) -> S {
    if x.value() <= 0.0 { S::zero() } else { (x.ln() * e).exp() }
}
