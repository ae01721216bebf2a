//! One round rod against one object: separation, sticking, sliding.
//!
//! For the ellipsoid in closed form after Lynch, Maekawa and Tanie 1992, in the form that needs no angles: the force that a
//! sticking contact would need decides. For the other surfaces the same conditions are solved numerically: sticking is the
//! minimum of a convex function of the angular velocity, sliding two equations for slip and angular velocity. The solution is
//! found in plain numbers; one Newton step in the scalar of the simulation then carries the derivatives (implicit functions).

use super::planar::{Twist, Vector, Wrench, add, cross, dot, norm, rot90, scale, sub};
use super::support::{Support, free_twist, mobility};
use super::surface::{Matrix, Surface};
use crate::{Dual, Scalar};

/// Relative size of a last Newton step: the error after it is its square.
const CONVERGED: f64 = 1e-7;

/// What the contact does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The rod does not touch.
    Free,
    /// It touches and does not slide.
    Stick,
    /// The rod slides to the side of `t = rot90(n)` relative to the object.
    Left,
    /// The rod slides to the other side.
    Right,
    /// It touches, and moves away or rests.
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
    fn values(&self) -> Touch<f64> {
        let f = |a: Vector<S>| a.map(S::value);
        Touch { point: f(self.point), normal: f(self.normal), velocity: f(self.velocity) }
    }
}

impl Touch<f64> {
    fn lift<T: Scalar>(&self) -> Touch<T> {
        let f = |a: Vector<f64>| a.map(T::constant);
        Touch { point: f(self.point), normal: f(self.normal), velocity: f(self.velocity) }
    }
}

/// How the object responds.
#[derive(Clone, Copy, Debug)]
pub struct Response<S> {
    /// What the contact does.
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

/// The twist of an object that the rod touches, and the force between them. `friction` is the coefficient of the contact.
#[inline]
pub fn respond<S: Scalar>(support: &Support<'_, S>, touch: &Touch<S>, friction: S) -> Response<S> {
    let approach = dot(touch.velocity, touch.normal).value();
    let Some(inertia) = &support.inertia else {
        if approach <= 0.0 {
            return Response::without_force(Mode::Separate, Twist::zero());
        }
        return match (&support.surface, support.loaded) {
            (Surface::Ellipsoid { c }, false) => ellipsoid(support, *c, touch, friction),
            _ => general(support, touch, friction),
        };
    };
    // With inertia an object may run ahead. Contact and free motion exclude each other (the one has a pushing force exactly
    // when the other would overlap), so that the likelier is tried first.
    let rate = |twist: &Twist<S>| dot(twist.at(touch.point), touch.normal).value();
    if approach > rate(&inertia.previous) {
        let response = general(support, touch, friction);
        if dot(response.force, touch.normal).value() > 0.0 {
            return response;
        }
    }
    let free = free_twist(support);
    if rate(&free) >= approach {
        return Response::without_force(Mode::Separate, free);
    }
    general(support, touch, friction)
}

fn slid(sign: f64) -> Mode {
    if sign > 0.0 { Mode::Left } else { Mode::Right }
}

/// Unit force on the edge of the friction cone, on the side of `sign`.
fn cone_edge<S: Scalar>(normal: Vector<S>, friction: S, sign: f64) -> Vector<S> {
    let k = S::constant(1.0) / (friction * friction + 1.0).sqrt();
    scale(add(normal, scale(rot90(normal), friction * sign)), k)
}

#[inline]
fn ellipsoid<S: Scalar>(support: &Support<'_, S>, c: S, touch: &Touch<S>, friction: S) -> Response<S> {
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

fn inverse_metric<S: Scalar>(h: Option<&Matrix<S>>) -> Matrix<S> {
    let (zero, one) = (S::zero(), S::constant(1.0));
    let Some(h) = h else { return [[one, zero], [zero, one]] };
    // B = HᵀH has determinant 1.
    let b = |i: usize, j: usize| h[0][i] * h[0][j] + h[1][i] * h[1][j];
    let off = -b(0, 1);
    [[b(1, 1), off], [off, b(0, 0)]]
}

/// Moment of the demand about the contact, with sticking at contact velocity `v`.
#[inline]
fn stick_residual<T: Scalar>(
    support: &Support<'_, T>,
    touch: &Touch<T>,
    v: Vector<T>,
    rotation: T,
) -> (T, Wrench<T>, Twist<T>) {
    let twist = Twist { velocity: sub(v, scale(rot90(touch.point), rotation)), rotation };
    let w = support.demand(&twist);
    (w.moment - cross(touch.point, w.force), w, twist)
}

/// Angular velocity of a sticking contact: the residual rises with it, so Newton's method is kept in a bracket.
fn stick_root(support: &Support<'_, f64>, touch: &Touch<f64>, v: Vector<f64>, start: f64) -> (f64, f64) {
    let (lifted, lifted_touch) = (support.lift::<Dual<1>>(), touch.lift::<Dual<1>>());
    let lifted_v = v.map(Dual::constant);
    let evaluate = |x: f64| stick_residual(&lifted, &lifted_touch, lifted_v, Dual::<1>::variable(x, 0)).0;
    let scale = norm(v) / support.surface.nominal_c();
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut x = start;
    let mut slope = 1.0;
    let mut reach = 0.1 * scale;
    for _ in 0..80 {
        let g = evaluate(x);
        slope = g.d[0];
        if g.value > 0.0 {
            high = high.min(x);
        } else {
            low = low.max(x);
        }
        if g.value == 0.0 {
            break;
        }
        let newton = x - g.value / slope;
        let next = if slope > 0.0 && newton > low && newton < high && (newton - x).abs() < 4.0 * scale {
            newton
        } else if low.is_finite() && high.is_finite() {
            0.5 * (low + high)
        } else {
            reach *= 2.0;
            if high.is_finite() { high - reach } else { low + reach }
        };
        let change = (next - x).abs();
        x = next;
        // Newton's method is quadratic: after a step this small nothing is left to gain.
        if change <= CONVERGED * scale {
            break;
        }
    }
    (x, slope)
}

/// Sliding on the edge of the cone: moment about the contact, and force across the edge.
#[inline]
fn slide_residual<T: Scalar>(
    support: &Support<'_, T>,
    touch: &Touch<T>,
    edge: Vector<T>,
    slip: T,
    rotation: T,
) -> ([T; 2], Wrench<T>, Twist<T>) {
    let v = sub(touch.velocity, scale(rot90(touch.normal), slip));
    let (moment, w, twist) = stick_residual(support, touch, v, rotation);
    ([moment, cross(edge, w.force)], w, twist)
}

/// Newton's method on the sliding contact, from `start` (slip, angular velocity). `None` if it does not converge, or where the
/// rod would have to pull or to slide against its own friction.
fn slide_root(
    support: &Support<'_, f64>,
    touch: &Touch<f64>,
    edge: Vector<f64>,
    sign: f64,
    start: [f64; 2],
) -> Option<[f64; 2]> {
    let (lifted, lifted_touch) = (support.lift::<Dual<2>>(), touch.lift::<Dual<2>>());
    let lifted_edge = edge.map(Dual::constant);
    let c = support.surface.nominal_c();
    let evaluate = |x: [f64; 2]| {
        let (slip, rotation) = (Dual::<2>::variable(x[0], 0), Dual::<2>::variable(x[1], 1));
        slide_residual(&lifted, &lifted_touch, lifted_edge, slip, rotation)
    };
    let merit = |r: &[Dual<2>; 2]| (r[0].value / c).powi(2) + r[1].value.powi(2);
    let speed = norm(touch.velocity);
    let mut x = start;
    let (mut r, mut w, _) = evaluate(x);
    let mut converged = false;
    for _ in 0..25 {
        let m = inverse2([r[0].d, r[1].d]);
        let step = [0, 1].map(|i| m[i][0] * r[0].value + m[i][1] * r[1].value);
        if !step.iter().all(|s| s.is_finite()) {
            return None;
        }
        if step[0].abs() <= CONVERGED * speed && step[1].abs() * c <= CONVERGED * speed {
            x = [x[0] - step[0], x[1] - step[1]];
            converged = true;
            break;
        }
        let before = merit(&r);
        let mut factor = 1.0;
        let mut better = false;
        for _ in 0..8 {
            let trial = [x[0] - factor * step[0], x[1] - factor * step[1]];
            let next = evaluate(trial);
            if merit(&next.0) < before {
                x = trial;
                (r, w, better) = (next.0, next.1, true);
                break;
            }
            factor *= 0.4;
        }
        if !better {
            // At the rounding error of the residual no step is better.
            converged = before < 1e-20;
            break;
        }
    }
    let pushes = dot(w.force, lifted_edge).value > 0.0;
    (converged && pushes && x[0] * sign >= 0.0).then_some(x)
}

fn inverse2(m: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let k = 1.0 / (m[0][0] * m[1][1] - m[0][1] * m[1][0]);
    [[m[1][1] * k, -m[0][1] * k], [-m[1][0] * k, m[0][0] * k]]
}

/// The slow road: for each slip the best angular velocity, and bisection on the slip.
fn slide_by_bisection(
    support: &Support<'_, f64>,
    touch: &Touch<f64>,
    edge: Vector<f64>,
    sign: f64,
    stick: f64,
) -> [f64; 2] {
    let speed = norm(touch.velocity).max(1e-12);
    let across = |size: f64, start: f64| {
        let v = sub(touch.velocity, scale(rot90(touch.normal), sign * size));
        let rotation = stick_root(support, touch, v, start).0;
        let (_, w, _) = stick_residual(support, touch, v, rotation);
        (sign * cross(edge, w.force), rotation)
    };
    let (mut low, mut high, mut rotation) = (0.0, 0.05 * speed, stick);
    for _ in 0..20 {
        let (excess, at) = across(high, rotation);
        rotation = at;
        if excess < 0.0 {
            break;
        }
        low = high;
        high *= 2.0;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let (excess, at) = across(middle, rotation);
        rotation = at;
        if excess < 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    [sign * 0.5 * (low + high), rotation]
}

fn general<S: Scalar>(support: &Support<'_, S>, touch: &Touch<S>, friction: S) -> Response<S> {
    let (values, touch_values, mu) = (support.values(), touch.values(), friction.value());
    let c = values.surface.nominal_c();
    let like = Support { surface: Surface::Ellipsoid { c }, loaded: false, inertia: None, ..values };
    let edge_of = |sign: f64| cone_edge(touch_values.normal, mu, sign);
    // Where the ellipsoid like this surface slides, this one is likely to: a sliding motion that its own friction opposes needs
    // no further check.
    let likely = match ellipsoid(&like, c, &touch_values, mu).mode {
        Mode::Left => Some(1.0),
        Mode::Right => Some(-1.0),
        _ => None,
    };
    if let Some(sign) = likely {
        let guess = slide_guess(&like, &touch_values, edge_of(sign));
        if let Some(found) = slide_root(&values, &touch_values, edge_of(sign), sign, guess) {
            return slide(support, &values, touch, friction, sign, found);
        }
    }
    let u = touch_values.velocity;
    let (rotation, slope) = stick_root(&values, &touch_values, u, stick_guess(&like, &touch_values));
    let (_, w, _) = stick_residual(&values, &touch_values, u, rotation);
    let n = touch_values.normal;
    let (normal_part, tangential) = (dot(w.force, n), dot(w.force, rot90(n)));
    if normal_part > 0.0 && tangential.abs() <= mu * normal_part {
        let mut rotation = S::constant(rotation);
        if S::DIFFERENTIATES {
            let (residual, ..) = stick_residual(support, touch, touch.velocity, rotation);
            rotation -= residual * (1.0 / slope);
        }
        let (_, w, twist) = stick_residual(support, touch, touch.velocity, rotation);
        return Response { mode: Mode::Stick, twist, force: w.force, slip: S::zero() };
    }
    let sign = if tangential >= 0.0 { 1.0 } else { -1.0 };
    let edge = edge_of(sign);
    let found = slide_root(&values, &touch_values, edge, sign, slide_guess(&like, &touch_values, edge))
        .or_else(|| slide_root(&values, &touch_values, edge, sign, [0.0, rotation]))
        .unwrap_or_else(|| slide_by_bisection(&values, &touch_values, edge, sign, rotation));
    slide(support, &values, touch, friction, sign, found)
}

/// The response of a contact that slides, found at slip and angular velocity `found`, with derivatives.
fn slide<S: Scalar>(
    support: &Support<'_, S>,
    values: &Support<'_, f64>,
    touch: &Touch<S>,
    friction: S,
    sign: f64,
    found: [f64; 2],
) -> Response<S> {
    let edge = cone_edge(touch.normal, friction, sign);
    let (mut slip, mut rotation) = (S::constant(found[0]), S::constant(found[1]));
    if S::DIFFERENTIATES {
        let slopes = {
            let edge = edge.map(|x| Dual::<2>::constant(x.value()));
            let (slip, rotation) = (Dual::variable(found[0], 0), Dual::variable(found[1], 1));
            slide_residual(&values.lift(), &touch.values().lift(), edge, slip, rotation).0
        };
        let m = inverse2([slopes[0].d, slopes[1].d]);
        let (residual, ..) = slide_residual(support, touch, edge, slip, rotation);
        slip -= residual[0] * m[0][0] + residual[1] * m[0][1];
        rotation -= residual[0] * m[1][0] + residual[1] * m[1][1];
    }
    let (_, w, twist) = slide_residual(support, touch, edge, slip, rotation);
    Response { mode: slid(sign), twist, force: w.force, slip }
}

/// Angular velocity of the ellipsoid like this surface, sticking.
fn stick_guess(like: &Support<'_, f64>, touch: &Touch<f64>) -> f64 {
    let c = like.surface.nominal_c();
    let arm = sub(touch.point, like.centre);
    let m = mobility(&inverse_metric(like.metric.as_ref()), c, arm);
    let u = touch.velocity;
    let k = 1.0 / (m[0][0] * m[1][1] - m[0][1] * m[0][1]);
    let f = [(m[1][1] * u[0] - m[0][1] * u[1]) * k, (m[0][0] * u[1] - m[0][1] * u[0]) * k];
    cross(arm, f) / (c * c)
}

/// Slip and angular velocity of the ellipsoid like this surface, sliding with a force along `edge`.
fn slide_guess(like: &Support<'_, f64>, touch: &Touch<f64>, edge: Vector<f64>) -> [f64; 2] {
    let c = like.surface.nominal_c();
    let arm = sub(touch.point, like.centre);
    let m = mobility(&inverse_metric(like.metric.as_ref()), c, arm);
    let unit = super::surface::apply(&m, edge);
    let k = dot(touch.velocity, touch.normal) / dot(unit, touch.normal).max(1e-12);
    let slip = dot(sub(touch.velocity, scale(unit, k)), rot90(touch.normal));
    [slip, cross(arm, edge) / (c * c) * k]
}
