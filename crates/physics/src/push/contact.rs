//! Contact between one round rod and one object: separation, sticking or sliding.
//!
//! For the ellipsoidal limit surface the response has a closed form. Lynch, Maekawa and Tanie (IROS 1992)
//! derive it with motion and friction cones; this is the equivalent without angles. With the arm `r` from the
//! centre of friction to the contact, `r⊥` its rotation by 90 degrees and `B` the metric of the surface, a
//! force `f` at the contact moves the contact point with a velocity proportional to
//!
//! ```text
//! v = M f,   M = B⁻¹ + r⊥ r⊥ᵀ / c²        (1)
//! ```
//!
//! Sticking at the rod's velocity `u` needs the direction `f = M⁻¹ u`. If that is inside the friction cone
//! the contact sticks; otherwise it slides with `f` on the edge of the cone that `f` is nearest to. For the
//! other surfaces see `contact_solver.rs`.

use super::planar::{Twist, Vector, add, cross, dot, rot90, scale, sub};
use super::support::{Support, mobility};
use super::surface::Matrix;
use crate::Scalar;

/// Mode of the contact between rod and object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The rod does not touch the object.
    Free,
    /// The rod touches the object and does not slide along it.
    Stick,
    /// The rod slides on the object in the direction of the tangent `t = rot90(n)`, n the contact normal.
    Left,
    /// The rod slides on the object against the tangent `t = rot90(n)`, n the contact normal.
    Right,
    /// The rod touches the object without pressing: it moves away or rests.
    Separate,
}

impl Mode {
    /// Name of the contact mode in files.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Free => "free",
            Mode::Stick => "stick",
            Mode::Left => "left",
            Mode::Right => "right",
            Mode::Separate => "separate",
        }
    }
}

/// Position, normal and rod velocity of a contact, in any frame that the three vectors share.
#[derive(Clone, Copy, Debug)]
pub struct Touch<S> {
    /// Contact point relative to the origin of the body, m.
    pub point: Vector<S>,
    /// Unit normal of the contact, into the object.
    pub normal: Vector<S>,
    /// Velocity of the rod at the contact, m/s.
    pub velocity: Vector<S>,
}

impl<S: Scalar> Touch<S> {
    /// Copy of the contact as plain numbers, without derivatives.
    pub(super) fn values(&self) -> Touch<f64> {
        let value = |a: Vector<S>| a.map(S::value);
        Touch { point: value(self.point), normal: value(self.normal), velocity: value(self.velocity) }
    }
}

impl Touch<f64> {
    /// Copy of the contact as constants of another scalar.
    pub(super) fn lift<T: Scalar>(&self) -> Touch<T> {
        let lift = |a: Vector<f64>| a.map(T::constant);
        Touch { point: lift(self.point), normal: lift(self.normal), velocity: lift(self.velocity) }
    }
}

/// Friction coefficient of the contact as a function of the slip speed.
///
/// `mu (1 + rise |slip|)`, but at least 5 % of `mu`, so that a negative rise cannot make it negative.
#[derive(Clone, Copy, Debug)]
pub struct ContactFriction<S> {
    /// Friction coefficient at zero slip.
    pub at_rest: S,
    /// Relative rise of the coefficient per slip speed, s/m; `None` for a constant coefficient.
    pub rise_s_per_m: Option<S>,
}

impl<S: Scalar> ContactFriction<S> {
    /// A friction law with a constant coefficient (Coulomb).
    pub fn coulomb(coefficient: S) -> Self {
        Self { at_rest: coefficient, rise_s_per_m: None }
    }

    /// Friction coefficient at the slip velocity `slip`, m/s.
    pub(super) fn at(&self, slip: S) -> S {
        let Some(rise) = self.rise_s_per_m else { return self.at_rest };
        let factor = rise * slip.abs() + 1.0;
        self.at_rest * if factor.value() > 0.05 { factor } else { S::constant(0.05) }
    }

    /// Converts the numbers of the friction law to another scalar with `f`.
    pub(super) fn map<T: Scalar>(&self, f: impl Fn(S) -> T + Copy) -> ContactFriction<T> {
        ContactFriction { at_rest: f(self.at_rest), rise_s_per_m: self.rise_s_per_m.map(f) }
    }
}

/// Response of the object to the rod: mode, twist, force and slip.
#[derive(Clone, Copy, Debug)]
pub struct Response<S> {
    /// Mode of the contact: free, sticking, sliding or separating.
    pub mode: Mode,
    /// Velocity and angular velocity of the object.
    pub twist: Twist<S>,
    /// Force of the rod on the object, in units of the sliding force `mu_s m g`.
    pub force: Vector<S>,
    /// Velocity of the rod relative to the object along the tangent `t = rot90(n)`, m/s.
    pub slip: S,
}

impl<S: Scalar> Response<S> {
    /// Response of an object on which the rod exerts no force.
    pub(super) fn without_force(mode: Mode, twist: Twist<S>) -> Self {
        Self { mode, twist, force: [S::zero(); 2], slip: S::zero() }
    }
}

/// Contact mode of sliding with a slip velocity of this sign.
pub(super) fn slide_mode(sign: f64) -> Mode {
    if sign > 0.0 { Mode::Left } else { Mode::Right }
}

/// Unit force on the edge of the friction cone at the side that `sign` selects (along or against `t`).
pub(super) fn cone_edge<S: Scalar>(normal: Vector<S>, friction: S, sign: f64) -> Vector<S> {
    let k = S::constant(1.0) / (friction * friction + 1.0).sqrt();
    scale(add(normal, scale(rot90(normal), friction * sign)), k)
}

/// Response of an object with the ellipsoidal limit surface to the rod, by formula (1).
#[inline]
pub(super) fn ellipsoid_response<S: Scalar>(
    support: &Support<'_, S>,
    c: S,
    touch: &Touch<S>,
    friction: S,
) -> Response<S> {
    let (n, u) = (touch.normal, touch.velocity);
    let t = rot90(n);
    let arm = sub(touch.point, support.centre);
    let inverse_metric = inverse_metric(support.metric.as_ref());
    let m = mobility(&inverse_metric, c, arm);
    let inverse_square = S::constant(1.0) / (c * c);
    // Twist caused by a force, up to a common factor.
    let twist_of = |f: Vector<S>| {
        let rotation = cross(arm, f) * inverse_square;
        let v = super::surface::apply(&inverse_metric, f);
        Twist { velocity: sub(v, scale(rot90(support.centre), rotation)), rotation }
    };
    let inverse_determinant = S::constant(1.0) / (m[0][0] * m[1][1] - m[0][1] * m[0][1]);
    let f = [
        (m[1][1] * u[0] - m[0][1] * u[1]) * inverse_determinant,
        (m[0][0] * u[1] - m[0][1] * u[0]) * inverse_determinant,
    ];
    let (normal_part, tangential) = (dot(f, n), dot(f, t));
    if normal_part.value() > 0.0 && tangential.abs().value() <= (friction * normal_part).value() {
        let twist = twist_of(f);
        let force = scale(f, ellipsoid_scale(support, &twist, f, c));
        return Response { mode: Mode::Stick, twist, force, slip: S::zero() };
    }
    let sign = if tangential.value() >= 0.0 { 1.0 } else { -1.0 };
    let f = cone_edge(n, friction, sign);
    let unit = super::surface::apply(&m, f);
    let along = dot(unit, n);
    if along.value() <= 0.0 {
        // The object is wedged: no sliding motion follows the rod. Use the sticking solution, which always
        // exists.
        let f = scale(u, inverse_determinant);
        return Response { mode: Mode::Stick, twist: twist_of(f), force: [S::zero(); 2], slip: S::zero() };
    }
    let k = dot(u, n) / along;
    let q = twist_of(f);
    let twist = Twist { velocity: scale(q.velocity, k), rotation: q.rotation * k };
    let slip = dot(sub(u, scale(unit, k)), t);
    Response { mode: slide_mode(sign), twist, force: scale(f, ellipsoid_scale(support, &q, f, c)), slip }
}

/// Factor that scales the force `f` onto the ellipsoid, where `twist` is the motion that `f` causes.
///
/// The power `f·v + m ω` of `f` is its squared norm in the metric of the ellipsoid.
fn ellipsoid_scale<S: Scalar>(support: &Support<'_, S>, twist: &Twist<S>, f: Vector<S>, c: S) -> S {
    let v = twist.at(support.centre);
    let square = dot(f, v) + twist.rotation * twist.rotation * c * c;
    S::constant(1.0) / square.sqrt()
}

/// Inverse of the metric `B = HᵀH` of anisotropic friction; the identity if friction is isotropic.
pub(super) fn inverse_metric<S: Scalar>(h: Option<&Matrix<S>>) -> Matrix<S> {
    let (zero, one) = (S::zero(), S::constant(1.0));
    let Some(h) = h else { return [[one, zero], [zero, one]] };
    // Since B = HᵀH has determinant 1, its inverse is its adjugate.
    let b = |i: usize, j: usize| h[0][i] * h[0][j] + h[1][i] * h[1][j];
    let off = -b(0, 1);
    [[b(1, 1), off], [off, b(0, 0)]]
}
