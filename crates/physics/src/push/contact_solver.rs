//! Numerical solution of a contact with any limit surface: sticking or sliding.
//!
//! With `u` the velocity of the rod, `r` the contact point, `n` and `t = rot90(n)` the contact normal and
//! tangent, and `(f, m)` the wrench that the support demands for a twist:
//!
//! ```text
//! sticking, one unknown ω:     m - r × f = 0                      (1)
//! sliding, unknowns s and ω:   m - r × f = 0,  e(s) × f = 0       (2)
//! ```
//!
//! For sticking the contact point moves with `u`; for sliding with `u - s t`, and `e(s)` is the edge of the
//! friction cone. The left side of (1) rises with ω, because it is the derivative of a convex function, so a
//! bracketed Newton's method always finds the root.
//!
//! The solution is found in plain numbers. One Newton step in the scalar of the simulation then carries the
//! derivatives (implicit function theorem).

use super::contact::{
    ContactFriction, Mode, Response, Touch, cone_edge, ellipsoid_response, inverse_metric, slide_mode,
};
use super::planar::{Twist, Vector, Wrench, add, cross, dot, norm, rot90, scale, sub};
use super::support::{STEP_TOLERANCE, Support, mobility};
use super::surface::Surface;
use super::warm_start::WarmStart;
use crate::{Dual, Scalar};

/// Moment residual of sticking, formula (1), at the contact velocity `v`; also the wrench and the twist.
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

/// Solution of the sticking contact, formula (1): angular velocity and derivatives.
struct StickSolution {
    /// Angular velocity of the object, rad/s.
    rotation: f64,
    /// Derivative of the moment residual with respect to the angular velocity.
    residual_derivative: f64,
    /// Derivative of the contact force with respect to the angular velocity.
    force_derivative: Vector<f64>,
}

/// Solves formula (1) for the angular velocity of a sticking contact, from the guess `start`.
///
/// Newton's method is kept in a bracket by bisection.
fn stick_root(support: &Support<'_, f64>, touch: &Touch<f64>, v: Vector<f64>, start: f64) -> StickSolution {
    let (lifted, lifted_touch) = (support.lift::<Dual<1>>(), touch.lift::<Dual<1>>());
    let lifted_v = v.map(Dual::constant);
    let evaluate = |x: f64| {
        let (g, w, _) = stick_residual(&lifted, &lifted_touch, lifted_v, Dual::<1>::variable(x, 0));
        (g, w.force.map(|f| f.d[0]))
    };
    let scale = norm(v) / support.surface.nominal_c();
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut x = start;
    let (mut residual_derivative, mut force_derivative) = (1.0, [0.0; 2]);
    let mut bracket_step = 0.1 * scale;
    for _ in 0..80 {
        let g;
        (g, force_derivative) = evaluate(x);
        residual_derivative = g.d[0];
        if g.value > 0.0 {
            high = high.min(x);
        } else {
            low = low.max(x);
        }
        if g.value == 0.0 {
            break;
        }
        let newton = x - g.value / residual_derivative;
        let next =
            if residual_derivative > 0.0 && newton > low && newton < high && (newton - x).abs() < 4.0 * scale
            {
                newton
            } else if low.is_finite() && high.is_finite() {
                0.5 * (low + high)
            } else {
                bracket_step *= 2.0;
                if high.is_finite() { high - bracket_step } else { low + bracket_step }
            };
        let change = (next - x).abs();
        x = next;
        // Convergence is quadratic, so after a step this small the error is at rounding level.
        if change <= STEP_TOLERANCE * scale {
            break;
        }
    }
    StickSolution { rotation: x, residual_derivative, force_derivative }
}

/// One edge of the friction cone; its angle may depend on the slip velocity.
#[derive(Clone, Copy)]
struct Cone<S> {
    normal: Vector<S>,
    friction: ContactFriction<S>,
    /// Direction of sliding: 1 along the contact tangent `t`, -1 against it.
    sign: f64,
}

impl<S: Scalar> Cone<S> {
    /// Unit force along the edge of the friction cone at this slip velocity.
    fn edge(&self, slip: S) -> Vector<S> {
        cone_edge(self.normal, self.friction.at(slip), self.sign)
    }
}

impl Cone<f64> {
    /// Copy of the cone edge as constants of another scalar.
    fn lift<T: Scalar>(&self) -> Cone<T> {
        Cone {
            normal: self.normal.map(T::constant),
            friction: self.friction.map(T::constant),
            sign: self.sign,
        }
    }
}

/// Residuals of sliding, formula (2): moment and force direction; also the wrench and the twist.
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

/// Solution of the sliding contact, formula (2): slip, angular velocity and derivatives.
struct SlideSolution {
    /// Slip velocity of the rod along the object, m/s.
    slip: f64,
    /// Angular velocity of the object, rad/s.
    rotation: f64,
    /// Inverse Jacobian of both residuals of formula (2) with respect to slip and angular velocity.
    inverse_jacobian: [[f64; 2]; 2],
    /// Jacobian of the contact force (rows x and y) with respect to slip and angular velocity.
    force_jacobian: [[f64; 2]; 2],
}

impl SlideSolution {
    /// The solution `x` (slip, angular velocity), with derivatives of the residuals `r` and the wrench `w`.
    fn new(x: [f64; 2], r: &[Dual<2>; 2], w: &Wrench<Dual<2>>) -> Self {
        let inverse_jacobian = inverse2([r[0].d, r[1].d]);
        Self { slip: x[0], rotation: x[1], inverse_jacobian, force_jacobian: w.force.map(|f| f.d) }
    }
}

/// Function from (slip, angular velocity) to the residuals of formula (2) and the wrench, as dual numbers.
fn slide_evaluation(
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

/// Solves formula (2) for a sliding contact by damped Newton steps from `start` (slip, rotation rate).
///
/// Returns `None` if the iteration does not converge, if the rod would have to pull, or if the slip has the
/// wrong sign for this edge of the cone.
fn slide_root(
    support: &Support<'_, f64>,
    touch: &Touch<f64>,
    cone: &Cone<f64>,
    start: [f64; 2],
) -> Option<SlideSolution> {
    let c = support.surface.nominal_c();
    let evaluate = slide_evaluation(support, touch, cone);
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
        if step[0].abs() <= STEP_TOLERANCE * speed && step[1].abs() * c <= STEP_TOLERANCE * speed {
            x = [x[0] - step[0], x[1] - step[1]];
            converged = true;
            break;
        }
        let before = merit(&r);
        let mut factor = 1.0;
        let mut has_improved = false;
        for _ in 0..8 {
            let trial = [x[0] - factor * step[0], x[1] - factor * step[1]];
            let next = evaluate(trial);
            if merit(&next.0) < before {
                x = trial;
                (r, w, has_improved) = (next.0, next.1, true);
                break;
            }
            factor *= 0.4;
        }
        if !has_improved {
            // No step improves a residual that is already at rounding level.
            converged = before < 1e-20;
            break;
        }
    }
    let pushes = dot(w.force.map(|f| f.value), cone.edge(x[0])) > 0.0;
    (converged && pushes && x[0] * cone.sign >= 0.0).then(|| SlideSolution::new(x, &r, &w))
}

/// Inverse of a 2 x 2 matrix.
fn inverse2(m: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let k = 1.0 / (m[0][0] * m[1][1] - m[0][1] * m[1][0]);
    [[m[1][1] * k, -m[0][1] * k], [-m[1][0] * k, m[0][0] * k]]
}

/// Solves formula (2) for a sliding contact by bisection on the slip.
///
/// Each slip needs the root of formula (1): slow, but it always converges.
fn slide_by_bisection(
    support: &Support<'_, f64>,
    touch: &Touch<f64>,
    cone: &Cone<f64>,
    stick_rotation: f64,
) -> [f64; 2] {
    let sign = cone.sign;
    let speed = norm(touch.velocity).max(1e-12);
    let excess_force = |size: f64, start: f64| {
        let v = sub(touch.velocity, scale(rot90(touch.normal), sign * size));
        let rotation = stick_root(support, touch, v, start).rotation;
        let (_, w, _) = stick_residual(support, touch, v, rotation);
        (sign * cross(cone.edge(sign * size), w.force), rotation)
    };
    let (mut low, mut high, mut rotation) = (0.0, 0.05 * speed, stick_rotation);
    for _ in 0..20 {
        let excess;
        (excess, rotation) = excess_force(high, rotation);
        if excess < 0.0 {
            break;
        }
        low = high;
        high *= 2.0;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let excess;
        (excess, rotation) = excess_force(middle, rotation);
        if excess < 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    [sign * 0.5 * (low + high), rotation]
}

/// Response of an object with any limit surface, for a rod that touches it.
///
/// Tries sliding where the equivalent ellipsoid slides, then sticking, then sliding on the side that the
/// sticking force points to.
pub(super) fn solve_contact<S: Scalar>(
    support: &Support<'_, S>,
    touch: &Touch<S>,
    friction: &ContactFriction<S>,
    warm_start: Option<WarmStart>,
) -> Response<S> {
    let (values, touch_values, plain) = (support.values(), touch.values(), friction.map(S::value));
    let c = values.surface.nominal_c();
    let ellipsoid_support =
        Support { surface: Surface::Ellipsoid { c }, loaded: false, inertia: None, ..values };
    let cone_of = |sign: f64| Cone { normal: touch_values.normal, friction: plain, sign };
    let u = touch_values.velocity;
    let previous_motion = |mode: Mode| warm_start.and_then(|previous| previous.scaled_motion(mode, norm(u)));
    // Where the equivalent ellipsoid slides, this surface probably does too. A sliding solution on a
    // consistent edge of the cone is the solution and needs no further check.
    let probable_sign = match ellipsoid_response(&ellipsoid_support, c, &touch_values, plain.at_rest).mode {
        Mode::Left => Some(1.0),
        Mode::Right => Some(-1.0),
        _ => None,
    };
    if let Some(sign) = probable_sign {
        let cone = cone_of(sign);
        let guess = previous_motion(slide_mode(sign))
            .unwrap_or_else(|| slide_guess(&ellipsoid_support, &touch_values, cone.edge(0.0)));
        if let Some(solution) = slide_root(&values, &touch_values, &cone, guess) {
            return slide_response(support, touch, friction, sign, &solution);
        }
    }
    let guess = previous_motion(Mode::Stick)
        .map_or_else(|| stick_guess(&ellipsoid_support, &touch_values), |[_, rotation]| rotation);
    let stick_solution = stick_root(&values, &touch_values, u, guess);
    let (_, w, _) = stick_residual(&values, &touch_values, u, stick_solution.rotation);
    let n = touch_values.normal;
    let (normal_part, tangential) = (dot(w.force, n), dot(w.force, rot90(n)));
    if normal_part > 0.0 && tangential.abs() <= plain.at_rest * normal_part {
        return stick_response(support, touch, &stick_solution);
    }
    let sign = if tangential >= 0.0 { 1.0 } else { -1.0 };
    let cone = cone_of(sign);
    let guess = previous_motion(slide_mode(sign))
        .unwrap_or_else(|| slide_guess(&ellipsoid_support, &touch_values, cone.edge(0.0)));
    let solution = slide_root(&values, &touch_values, &cone, guess)
        .or_else(|| slide_root(&values, &touch_values, &cone, [0.0, stick_solution.rotation]))
        .unwrap_or_else(|| {
            let x = slide_by_bisection(&values, &touch_values, &cone, stick_solution.rotation);
            let (r, w) = slide_evaluation(&values, &touch_values, &cone)(x);
            SlideSolution::new(x, &r, &w)
        });
    slide_response(support, touch, friction, sign, &solution)
}

/// Response of a sticking contact, with derivatives from one Newton step.
fn stick_response<S: Scalar>(
    support: &Support<'_, S>,
    touch: &Touch<S>,
    solution: &StickSolution,
) -> Response<S> {
    let mut rotation = S::constant(solution.rotation);
    let (residual, w, mut twist) = stick_residual(support, touch, touch.velocity, rotation);
    let mut force = w.force;
    if S::DIFFERENTIATES {
        // One Newton step in `S` carries the derivatives; the force follows to first order.
        let step = residual * (-1.0 / solution.residual_derivative);
        rotation += step;
        force = add(force, solution.force_derivative.map(|k| step * k));
        twist = Twist { velocity: sub(touch.velocity, scale(rot90(touch.point), rotation)), rotation };
    }
    Response { mode: Mode::Stick, twist, force, slip: S::zero() }
}

/// Response of a sliding contact, with derivatives from one Newton step.
fn slide_response<S: Scalar>(
    support: &Support<'_, S>,
    touch: &Touch<S>,
    friction: &ContactFriction<S>,
    sign: f64,
    solution: &SlideSolution,
) -> Response<S> {
    let cone = Cone { normal: touch.normal, friction: *friction, sign };
    let (mut slip, mut rotation) = (S::constant(solution.slip), S::constant(solution.rotation));
    let (residual, w, mut twist) = slide_residual(support, touch, &cone, slip, rotation);
    let mut force = w.force;
    if S::DIFFERENTIATES {
        // One Newton step in `S` carries the derivatives; the force follows to first order.
        let step = solution.inverse_jacobian.map(|row| -(residual[0] * row[0] + residual[1] * row[1]));
        slip += step[0];
        rotation += step[1];
        force = add(force, solution.force_jacobian.map(|k| step[0] * k[0] + step[1] * k[1]));
        let v = sub(touch.velocity, scale(rot90(touch.normal), slip));
        twist = Twist { velocity: sub(v, scale(rot90(touch.point), rotation)), rotation };
    }
    Response { mode: slide_mode(sign), twist, force, slip }
}

/// Initial guess for formula (1): the angular velocity of the sticking equivalent ellipsoid, rad/s.
fn stick_guess(ellipsoid_support: &Support<'_, f64>, touch: &Touch<f64>) -> f64 {
    let c = ellipsoid_support.surface.nominal_c();
    let arm = sub(touch.point, ellipsoid_support.centre);
    let m = mobility(&inverse_metric(ellipsoid_support.metric.as_ref()), c, arm);
    let u = touch.velocity;
    let k = 1.0 / (m[0][0] * m[1][1] - m[0][1] * m[0][1]);
    let f = [(m[1][1] * u[0] - m[0][1] * u[1]) * k, (m[0][0] * u[1] - m[0][1] * u[0]) * k];
    cross(arm, f) / (c * c)
}

/// Initial guess for formula (2): slip, m/s, and angular velocity, rad/s, of the equivalent ellipsoid.
///
/// The contact force is along `edge`.
fn slide_guess(ellipsoid_support: &Support<'_, f64>, touch: &Touch<f64>, edge: Vector<f64>) -> [f64; 2] {
    let c = ellipsoid_support.surface.nominal_c();
    let arm = sub(touch.point, ellipsoid_support.centre);
    let m = mobility(&inverse_metric(ellipsoid_support.metric.as_ref()), c, arm);
    let unit = super::surface::apply(&m, edge);
    let k = dot(touch.velocity, touch.normal) / dot(unit, touch.normal).max(1e-12);
    let slip = dot(sub(touch.velocity, scale(unit, k)), rot90(touch.normal));
    [slip, cross(arm, edge) / (c * c) * k]
}
