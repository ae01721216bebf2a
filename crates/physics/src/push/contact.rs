//! One round rod against one object: separation, sticking, sliding.
//!
//! For the ellipsoid in closed form after Lynch, Maekawa and Tanie 1992, in the form that needs no angles: the force that a
//! sticking contact would need decides. For the other surfaces see `contact_solver.rs`.

use super::planar::{Twist, Vector, add, cross, dot, rot90, scale, sub};
use super::support::{Support, mobility};
use super::surface::Matrix;
use crate::Scalar;

/// Mode of a contact: apart, sticking, or sliding one way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The rod does not touch.
    Free,
    /// The rod touches and does not slide.
    Stick,
    /// The rod slides to the side of `t = rot90(n)` relative to the object.
    Left,
    /// The rod slides to the other side.
    Right,
    /// The rod touches, and moves away or rests.
    Separate,
}

impl Mode {
    /// The word in files.
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

/// A rod that touches an object, in any frame that the three vectors share.
#[derive(Clone, Copy, Debug)]
pub struct Touch<S> {
    /// Contact point from the body's origin, m.
    pub point: Vector<S>,
    /// Unit normal into the object.
    pub normal: Vector<S>,
    /// Velocity of the rod, m/s.
    pub velocity: Vector<S>,
}

impl<S: Scalar> Touch<S> {
    pub(super) fn values(&self) -> Touch<f64> {
        let f = |a: Vector<S>| a.map(S::value);
        Touch { point: f(self.point), normal: f(self.normal), velocity: f(self.velocity) }
    }
}

impl Touch<f64> {
    pub(super) fn lift<T: Scalar>(&self) -> Touch<T> {
        let f = |a: Vector<f64>| a.map(T::constant);
        Touch { point: f(self.point), normal: f(self.normal), velocity: f(self.velocity) }
    }
}

/// Friction of the contact, `mu (1 + rise |slip|)`, at least a twentieth of `mu`.
#[derive(Clone, Copy, Debug)]
pub struct ContactFriction<S> {
    /// Coefficient without slip.
    pub at_rest: S,
    /// Relative rise with the speed of the slip, s/m.
    pub rise_s_per_m: Option<S>,
}

impl<S: Scalar> ContactFriction<S> {
    /// Coulomb's: one coefficient.
    pub fn coulomb(coefficient: S) -> Self {
        Self { at_rest: coefficient, rise_s_per_m: None }
    }

    /// The coefficient at a slip, m/s.
    pub(super) fn at(&self, slip: S) -> S {
        let Some(rise) = self.rise_s_per_m else { return self.at_rest };
        let factor = rise * slip.abs() + 1.0;
        self.at_rest * if factor.value() > 0.05 { factor } else { S::constant(0.05) }
    }

    pub(super) fn map<T: Scalar>(&self, f: impl Fn(S) -> T + Copy) -> ContactFriction<T> {
        ContactFriction { at_rest: f(self.at_rest), rise_s_per_m: self.rise_s_per_m.map(f) }
    }
}

/// How the object responds.
#[derive(Clone, Copy, Debug)]
pub struct Response<S> {
    /// Mode of the contact.
    pub mode: Mode,
    /// The object's twist.
    pub twist: Twist<S>,
    /// Force of the rod on the object, in units of the sliding force `mu_s m g`.
    pub force: Vector<S>,
    /// Velocity of the rod relative to the object along `t = rot90(n)`, m/s.
    pub slip: S,
}

impl<S: Scalar> Response<S> {
    /// No force from the rod.
    pub(super) fn without_force(mode: Mode, twist: Twist<S>) -> Self {
        Self { mode, twist, force: [S::zero(); 2], slip: S::zero() }
    }
}

pub(super) fn slid(sign: f64) -> Mode {
    if sign > 0.0 { Mode::Left } else { Mode::Right }
}

/// Unit force on the edge of the friction cone, on the side of `sign`.
pub(super) fn cone_edge<S: Scalar>(normal: Vector<S>, friction: S, sign: f64) -> Vector<S> {
    let k = S::constant(1.0) / (friction * friction + 1.0).sqrt();
    scale(add(normal, scale(rot90(normal), friction * sign)), k)
}

#[inline]
pub(super) fn ellipsoid<S: Scalar>(
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
    // Twist of a force, up to the common factor.
    let twist_of = |f: Vector<S>| {
        let rotation = cross(arm, f) * inverse_square;
        let v = super::surface::apply(&inverse_metric, f);
        Twist { velocity: sub(v, scale(rot90(support.centre), rotation)), rotation }
    };
    let determinant = S::constant(1.0) / (m[0][0] * m[1][1] - m[0][1] * m[0][1]);
    let f =
        [(m[1][1] * u[0] - m[0][1] * u[1]) * determinant, (m[0][0] * u[1] - m[0][1] * u[0]) * determinant];
    let (normal_part, tangential) = (dot(f, n), dot(f, t));
    if normal_part.value() > 0.0 && tangential.abs().value() <= (friction * normal_part).value() {
        let twist = twist_of(f);
        let force = scale(f, limit(support, &twist, f, c));
        return Response { mode: Mode::Stick, twist, force, slip: S::zero() };
    }
    let sign = if tangential.value() >= 0.0 { 1.0 } else { -1.0 };
    let f = cone_edge(n, friction, sign);
    let unit = super::surface::apply(&m, f);
    let along = dot(unit, n);
    if along.value() <= 0.0 {
        // Wedged: no sliding motion goes with the rod. Take the sticking one, which exists for every surface.
        let f = scale(u, determinant);
        return Response { mode: Mode::Stick, twist: twist_of(f), force: [S::zero(); 2], slip: S::zero() };
    }
    let k = dot(u, n) / along;
    let q = twist_of(f);
    let twist = Twist { velocity: scale(q.velocity, k), rotation: q.rotation * k };
    let slip = dot(sub(u, scale(unit, k)), t);
    Response { mode: slid(sign), twist, force: scale(f, limit(support, &q, f, c)), slip }
}

/// Factor that puts `f`, which drives `twist`, on the ellipsoid: `f·v + m ω` is its square measure.
fn limit<S: Scalar>(support: &Support<'_, S>, twist: &Twist<S>, f: Vector<S>, c: S) -> S {
    let v = twist.at(support.centre);
    let square = dot(f, v) + twist.rotation * twist.rotation * c * c;
    S::constant(1.0) / square.sqrt()
}

pub(super) fn inverse_metric<S: Scalar>(h: Option<&Matrix<S>>) -> Matrix<S> {
    let (zero, one) = (S::zero(), S::constant(1.0));
    let Some(h) = h else { return [[one, zero], [zero, one]] };
    // B = HᵀH has determinant 1.
    let b = |i: usize, j: usize| h[0][i] * h[0][j] + h[1][i] * h[1][j];
    let off = -b(0, 1);
    [[b(1, 1), off], [off, b(0, 0)]]
}
