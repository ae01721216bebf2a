//! The superellipsoidal limit surface `|f|^p + |m/c|^p = 1`.
//!
//! p = 2 is the ellipsoid; p = 1.70 with the `c` of uniform pressure lies within 1 % of the exact surface of a square.

use crate::Scalar;
use crate::push::planar::{Vector, Wrench, norm, scale};

/// `D = (|v|^q + |c ω|^q)^(1/q)` with `q = p/(p-1)`.
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

/// `x^e` for `x >= 0` and `e > 0`.
fn power<S: Scalar>(x: S, e: S) -> S {
    if x.value() <= 0.0 { S::zero() } else { (x.ln() * e).exp() }
}
