//! A contact against any surface: the conditions of sticking and sliding, solved numerically.
//!
//! Sticking is the minimum of a convex function of the angular velocity, sliding two equations for slip and angular velocity.
//! The solution is found in plain numbers; one Newton step in the scalar of the simulation then carries the derivatives
//! (implicit functions).

use super::contact::{ContactFriction, Mode, Response, Touch, cone_edge, ellipsoid, inverse_metric, slid};
use super::near::Near;
use super::planar::{Twist, Vector, Wrench, add, cross, dot, norm, rot90, scale, sub};
use super::support::{Support, mobility};
use super::surface::Surface;
use crate::{Dual, Scalar};

/// Relative size of a last Newton step: the error after it is its square.
const CONVERGED: f64 = 1e-7;

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

/// A contact that sticks.
struct Stuck {
    rotation: f64,
    /// Slopes of the residual and of the force with the angular velocity.
    slope: f64,
    force: Vector<f64>,
}

/// Angular velocity of a sticking contact: the residual rises with it, so Newton's method is kept in a bracket.
fn stick_root(support: &Support<'_, f64>, touch: &Touch<f64>, v: Vector<f64>, start: f64) -> Stuck {
    let (lifted, lifted_touch) = (support.lift::<Dual<1>>(), touch.lift::<Dual<1>>());
    let lifted_v = v.map(Dual::constant);
    let evaluate = |x: f64| {
        let (g, w, _) = stick_residual(&lifted, &lifted_touch, lifted_v, Dual::<1>::variable(x, 0));
        (g, w.force.map(|f| f.d[0]))
    };
    let scale = norm(v) / support.surface.nominal_c();
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut x = start;
    let (mut slope, mut force) = (1.0, [0.0; 2]);
    let mut reach = 0.1 * scale;
    for _ in 0..80 {
        let (g, force_slope) = evaluate(x);
        (slope, force) = (g.d[0], force_slope);
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
    Stuck { rotation: x, slope, force }
}

/// A side of the friction cone, which may open with the slip.
#[derive(Clone, Copy)]
struct Cone<S> {
    normal: Vector<S>,
    friction: ContactFriction<S>,
    /// 1 to the left, -1 to the right.
    sign: f64,
}

impl<S: Scalar> Cone<S> {
    /// Unit force on the edge.
    fn edge(&self, slip: S) -> Vector<S> {
        cone_edge(self.normal, self.friction.at(slip), self.sign)
    }
}

impl Cone<f64> {
    fn lift<T: Scalar>(&self) -> Cone<T> {
        Cone {
            normal: self.normal.map(T::constant),
            friction: self.friction.map(T::constant),
            sign: self.sign,
        }
    }
}

/// Sliding on the edge of the cone: moment about the contact, and force across the edge.
#[inline]
fn slide_residual<T: Scalar>(
    support: &Support<'_, T>,
    touch: &Touch<T>,
    cone: &Cone<T>,
    slip: T,
    rotation: T,
) -> ([T; 2], Wrench<T>, Twist<T>) {
    let edge = cone.edge(slip);
    let v = sub(touch.velocity, scale(rot90(touch.normal), slip));
    let (moment, w, twist) = stick_residual(support, touch, v, rotation);
    ([moment, cross(edge, w.force)], w, twist)
}

/// A contact that slides.
struct Slid {
    slip: f64,
    rotation: f64,
    /// Inverse of the slopes of the two residuals with slip and angular velocity.
    inverse: [[f64; 2]; 2],
    /// Slopes of the force, x and y, with both.
    force: [[f64; 2]; 2],
}

impl Slid {
    /// At `x` (slip, angular velocity), with the residuals and the demand near it.
    fn new(x: [f64; 2], r: &[Dual<2>; 2], w: &Wrench<Dual<2>>) -> Self {
        let inverse = inverse2([r[0].d, r[1].d]);
        Self { slip: x[0], rotation: x[1], inverse, force: w.force.map(|f| f.d) }
    }
}

/// Residuals and demand of a sliding contact with their slopes in slip and angular velocity.
fn slide_slopes(
    support: &Support<'_, f64>,
    touch: &Touch<f64>,
    cone: &Cone<f64>,
) -> impl Fn([f64; 2]) -> ([Dual<2>; 2], Wrench<Dual<2>>) {
    let (lifted, lifted_touch) = (support.lift::<Dual<2>>(), touch.lift::<Dual<2>>());
    let lifted_cone = cone.lift();
    move |x: [f64; 2]| {
        let (slip, rotation) = (Dual::<2>::variable(x[0], 0), Dual::<2>::variable(x[1], 1));
        let (r, w, _) = slide_residual(&lifted, &lifted_touch, &lifted_cone, slip, rotation);
        (r, w)
    }
}

/// Newton's method on the sliding contact, from `start` (slip, angular velocity). `None` if it does not converge, or where the
/// rod would have to pull or to slide against its own friction.
fn slide_root(
    support: &Support<'_, f64>,
    touch: &Touch<f64>,
    cone: &Cone<f64>,
    start: [f64; 2],
) -> Option<Slid> {
    let c = support.surface.nominal_c();
    let evaluate = slide_slopes(support, touch, cone);
    let merit = |r: &[Dual<2>; 2]| (r[0].value / c).powi(2) + r[1].value.powi(2);
    let speed = norm(touch.velocity);
    let mut x = start;
    let (mut r, mut w) = evaluate(x);
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
    let pushes = dot(w.force.map(|f| f.value), cone.edge(x[0])) > 0.0;
    (converged && pushes && x[0] * cone.sign >= 0.0).then(|| Slid::new(x, &r, &w))
}

fn inverse2(m: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let k = 1.0 / (m[0][0] * m[1][1] - m[0][1] * m[1][0]);
    [[m[1][1] * k, -m[0][1] * k], [-m[1][0] * k, m[0][0] * k]]
}

/// The slow road: for each slip the best angular velocity, and bisection on the slip.
fn slide_by_bisection(
    support: &Support<'_, f64>,
    touch: &Touch<f64>,
    cone: &Cone<f64>,
    stick: f64,
) -> [f64; 2] {
    let sign = cone.sign;
    let speed = norm(touch.velocity).max(1e-12);
    let across = |size: f64, start: f64| {
        let v = sub(touch.velocity, scale(rot90(touch.normal), sign * size));
        let rotation = stick_root(support, touch, v, start).rotation;
        let (_, w, _) = stick_residual(support, touch, v, rotation);
        (sign * cross(cone.edge(sign * size), w.force), rotation)
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

pub(super) fn general<S: Scalar>(
    support: &Support<'_, S>,
    touch: &Touch<S>,
    friction: &ContactFriction<S>,
    near: Option<Near>,
) -> Response<S> {
    let (values, touch_values, plain) = (support.values(), touch.values(), friction.map(S::value));
    let c = values.surface.nominal_c();
    let like = Support { surface: Surface::Ellipsoid { c }, loaded: false, inertia: None, ..values };
    let cone_of = |sign: f64| Cone { normal: touch_values.normal, friction: plain, sign };
    let u = touch_values.velocity;
    let before = |mode: Mode| near.and_then(|n| n.motion(mode, norm(u)));
    // Where the ellipsoid like this surface slides, this one is likely to: a sliding motion that its own friction opposes needs
    // no further check.
    let likely = match ellipsoid(&like, c, &touch_values, plain.at_rest).mode {
        Mode::Left => Some(1.0),
        Mode::Right => Some(-1.0),
        _ => None,
    };
    if let Some(sign) = likely {
        let cone = cone_of(sign);
        let guess = before(slid(sign)).unwrap_or_else(|| slide_guess(&like, &touch_values, cone.edge(0.0)));
        if let Some(found) = slide_root(&values, &touch_values, &cone, guess) {
            return slide(support, touch, friction, sign, &found);
        }
    }
    let guess =
        before(Mode::Stick).map_or_else(|| stick_guess(&like, &touch_values), |[_, rotation]| rotation);
    let stuck = stick_root(&values, &touch_values, u, guess);
    let (_, w, _) = stick_residual(&values, &touch_values, u, stuck.rotation);
    let n = touch_values.normal;
    let (normal_part, tangential) = (dot(w.force, n), dot(w.force, rot90(n)));
    if normal_part > 0.0 && tangential.abs() <= plain.at_rest * normal_part {
        return stick(support, touch, &stuck);
    }
    let sign = if tangential >= 0.0 { 1.0 } else { -1.0 };
    let cone = cone_of(sign);
    let guess = before(slid(sign)).unwrap_or_else(|| slide_guess(&like, &touch_values, cone.edge(0.0)));
    let found = slide_root(&values, &touch_values, &cone, guess)
        .or_else(|| slide_root(&values, &touch_values, &cone, [0.0, stuck.rotation]))
        .unwrap_or_else(|| {
            let x = slide_by_bisection(&values, &touch_values, &cone, stuck.rotation);
            let (r, w) = slide_slopes(&values, &touch_values, &cone)(x);
            Slid::new(x, &r, &w)
        });
    slide(support, touch, friction, sign, &found)
}

/// The response of a contact that sticks, with derivatives.
fn stick<S: Scalar>(support: &Support<'_, S>, touch: &Touch<S>, found: &Stuck) -> Response<S> {
    let mut rotation = S::constant(found.rotation);
    let (residual, w, mut twist) = stick_residual(support, touch, touch.velocity, rotation);
    let mut force = w.force;
    if S::DIFFERENTIATES {
        // One Newton step, and what it changes.
        let step = residual * (-1.0 / found.slope);
        rotation += step;
        force = add(force, found.force.map(|k| step * k));
        twist = Twist { velocity: sub(touch.velocity, scale(rot90(touch.point), rotation)), rotation };
    }
    Response { mode: Mode::Stick, twist, force, slip: S::zero() }
}

/// The response of a contact that slides, with derivatives.
fn slide<S: Scalar>(
    support: &Support<'_, S>,
    touch: &Touch<S>,
    friction: &ContactFriction<S>,
    sign: f64,
    found: &Slid,
) -> Response<S> {
    let cone = Cone { normal: touch.normal, friction: *friction, sign };
    let (mut slip, mut rotation) = (S::constant(found.slip), S::constant(found.rotation));
    let (residual, w, mut twist) = slide_residual(support, touch, &cone, slip, rotation);
    let mut force = w.force;
    if S::DIFFERENTIATES {
        // One Newton step, and what it changes.
        let step = found.inverse.map(|row| -(residual[0] * row[0] + residual[1] * row[1]));
        slip += step[0];
        rotation += step[1];
        force = add(force, found.force.map(|k| step[0] * k[0] + step[1] * k[1]));
        let v = sub(touch.velocity, scale(rot90(touch.normal), slip));
        twist = Twist { velocity: sub(v, scale(rot90(touch.point), rotation)), rotation };
    }
    Response { mode: slid(sign), twist, force, slip }
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
