//! The ellipsoidal limit surface.
//!
//! Sources: Lynch, Maekawa and Tanie, IROS 1992; Howe and Cutkosky, IJRR 15:557, 1996.

use crate::Scalar;
use crate::push::planar::{Vector, Wrench, dot, scale};

/// Friction wrench of the ellipsoid against a twist: the gradient of `D = √(|v|² + c² ω²)`; zero at rest.
///
/// ```
/// use augsim_physics::push::surface::ellipsoid::wrench;
/// // Pure rotation is resisted by a moment of c, in units of the sliding force.
/// let turning = wrench(0.03, [0.0, 0.0], 2.0);
/// assert!((turning.moment.abs() - 0.03).abs() < 1e-15);
/// let sliding = wrench(0.03, [0.1, 0.0], 0.0);
/// assert!((sliding.force[0].abs() - 1.0).abs() < 1e-15);
/// ```
#[inline]
pub fn wrench<S: Scalar>(c: S, velocity: Vector<S>, rotation: S) -> Wrench<S> {
    let square = dot(velocity, velocity) + c * c * rotation * rotation;
    if square.value() <= 0.0 {
        return Wrench::zero();
    }
    let k = S::constant(1.0) / square.sqrt();
    Wrench { force: scale(velocity, k), moment: c * c * rotation * k }
}
