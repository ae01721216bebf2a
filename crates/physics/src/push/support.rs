//! Forces on a sliding object at one instant, except that of the rod: friction, loads and inertia.
//!
//! With inertia a step is implicit Euler, and without a rod the object moves with the twist that demands no wrench
//! ([`Support::demand`]). Friction is smoothed near rest, where it would jump.

use super::planar::{Twist, Vector, Wrench, add, cross, dot, norm, rot90, scale, sub};
use super::surface::{Matrix, Surface, apply, apply_transposed, footprint_map};
use crate::{Dual, Scalar};

/// Mass and moment of inertia over one implicit Euler step `h`, in units of the sliding force `f_max`.
#[derive(Clone, Copy, Debug)]
pub struct Inertia<S> {
    /// Mass divided by step and sliding force, `m / (h f_max)`, s/m.
    pub mass: S,
    /// Moment of inertia divided by step and sliding force, `I / (h f_max)`, m s.
    pub moment: S,
    /// Twist of the object before the step.
    pub previous: Twist<S>,
}

/// Dissipation per sliding force, m/s, below which friction is smoothed for objects with inertia.
///
/// An object that should be at rest creeps at a fraction of this speed.
const FRICTION_SMOOTHING_M_S: f64 = 2e-5;

/// Relative size of a Newton step that ends the iteration; the error after it is about its square.
pub(super) const STEP_TOLERANCE: f64 = 1e-7;

/// Friction, loads and inertia of a sliding object, in the body frame.
#[derive(Clone, Copy, Debug)]
pub struct Support<'a, S> {
    /// Limit surface of the friction, about the centre of friction.
    pub surface: Surface<'a, S>,
    /// Centre of friction in the body frame, m.
    pub centre: Vector<S>,
    /// Map `H` of velocities for anisotropic friction; `None` if isotropic. Its determinant is 1.
    ///
    /// Sliding with velocity v dissipates `|H v|` instead of `|v|`.
    pub metric: Option<Matrix<S>>,
    /// Load on the object other than friction and rod force, in units of the sliding force.
    pub load: Wrench<S>,
    /// Whether the load [`load`](Self::load) is not zero.
    pub loaded: bool,
    /// Inertia of the object; `None` for quasi-static motion.
    pub inertia: Option<Inertia<S>>,
}

impl<'a, S: Scalar> Support<'a, S> {
    /// A support with isotropic friction by `surface` about the body's origin, without load or inertia.
    pub fn plain(surface: Surface<'a, S>) -> Self {
        Self {
            surface,
            centre: [S::zero(); 2],
            metric: None,
            load: Wrench::zero(),
            loaded: false,
            inertia: None,
        }
    }

    /// Wrench that overcomes friction at `twist`, in units of the sliding force.
    ///
    /// The moment is about the origin of the body.
    #[inline]
    pub fn friction(&self, twist: &Twist<S>) -> Wrench<S> {
        let v = twist.at(self.centre);
        let w = match &self.metric {
            None => self.surface.wrench(v, twist.rotation, None),
            Some(h) => {
                let w = self.surface.wrench(apply(h, v), twist.rotation, Some(&footprint_map(h)));
                Wrench { force: apply_transposed(h, w.force), moment: w.moment }
            }
        };
        Wrench { force: w.force, moment: w.moment + cross(self.centre, w.force) }
    }

    /// Wrench that must be applied for the object to move with `twist`, against friction, load and inertia.
    ///
    /// It is in units of the sliding force.
    #[inline]
    pub fn demand(&self, twist: &Twist<S>) -> Wrench<S> {
        let mut w = self.friction(twist);
        if let Some(inertia) = &self.inertia {
            let dissipation = dot(w.force, twist.velocity) + w.moment * twist.rotation;
            let smoothing = dissipation / (dissipation + FRICTION_SMOOTHING_M_S);
            let velocity_change = sub(twist.velocity, inertia.previous.velocity);
            w.force = add(scale(w.force, smoothing), scale(velocity_change, inertia.mass));
            w.moment = w.moment * smoothing + (twist.rotation - inertia.previous.rotation) * inertia.moment;
        }
        if self.loaded {
            w.force = sub(w.force, self.load.force);
            w.moment -= self.load.moment;
        }
        w
    }

    /// Converts the numbers of the support to another scalar with `f`.
    pub fn map<T: Scalar>(&self, f: impl Fn(S) -> T + Copy) -> Support<'a, T> {
        let vector = |a: Vector<S>| a.map(f);
        let twist = |t: Twist<S>| Twist { velocity: vector(t.velocity), rotation: f(t.rotation) };
        Support {
            surface: self.surface.map(f),
            centre: vector(self.centre),
            metric: self.metric.map(|m| m.map(vector)),
            load: Wrench { force: vector(self.load.force), moment: f(self.load.moment) },
            loaded: self.loaded,
            inertia: self.inertia.map(|i| Inertia {
                mass: f(i.mass),
                moment: f(i.moment),
                previous: twist(i.previous),
            }),
        }
    }

    /// Copy of the support as plain numbers, without derivatives.
    pub fn values(&self) -> Support<'a, f64> {
        self.map(S::value)
    }
}

impl<'a> Support<'a, f64> {
    /// Copy of the support as constants of another scalar.
    pub(super) fn lift<T: Scalar>(&self) -> Support<'a, T> {
        self.map(T::constant)
    }
}

/// Twist of an object without a rod: the twist at which [`Support::demand`] vanishes.
///
/// It differs from rest only with inertia. Damped Newton steps reduce the norm of the demand, with the moment divided by
/// the nominal radius.
pub(super) fn free_twist<S: Scalar>(support: &Support<'_, S>) -> Twist<S> {
    let Some(inertia) = &support.inertia else { return Twist::zero() };
    let values = support.values();
    let previous = inertia.previous.velocity.map(S::value);
    let mut x = [previous[0], previous[1], inertia.previous.rotation.value()];
    let lifted: Support<'_, Dual<3>> = values.lift();
    let demand_with_derivatives = |x: [f64; 3]| {
        let lane = |i: usize| Dual::<3>::variable(x[i], i);
        let w = lifted.demand(&Twist { velocity: [lane(0), lane(1)], rotation: lane(2) });
        [w.force[0], w.force[1], w.moment]
    };
    let c = values.surface.nominal_c();
    let squared_norm = |w: &[Dual<3>; 3]| w[0].value.powi(2) + w[1].value.powi(2) + (w[2].value / c).powi(2);
    let evaluate = |x: [f64; 3]| {
        let w = demand_with_derivatives(x);
        (squared_norm(&w), w)
    };
    // Rest is a better start than the previous twist if friction stops the object within the step. It is
    // approached from a tiny twist because friction has no derivative at rest.
    let (mut size, mut w) = evaluate(x);
    let tiny = x.map(|v| 1e-6 * v);
    let at_rest = evaluate(tiny);
    if at_rest.0 < size {
        (x, (size, w)) = (tiny, at_rest);
    }
    let speed = norm(previous) + c * x[2].abs();
    for _ in 0..60 {
        let Some(step) = solve3(w.map(|d| d.d), w.map(|d| d.value)) else { break };
        let tolerance = STEP_TOLERANCE * speed;
        // Convergence is quadratic, so after a step this small the error is at rounding level.
        if step[0].abs() <= tolerance && step[1].abs() <= tolerance && c * step[2].abs() <= tolerance {
            x = [0, 1, 2].map(|i| x[i] - step[i]);
            break;
        }
        let trials = (0..30).map(|halvings| 0.5f64.powi(halvings)).map(|factor| {
            let trial = [0, 1, 2].map(|i| x[i] - factor * step[i]);
            (factor, trial, evaluate(trial))
        });
        let mut better = trials.filter(|(factor, _, (next, _))| *next <= size * (1.0 - 1e-4 * factor));
        let Some((_, trial, next)) = better.next() else { break };
        (x, (size, w)) = (trial, next);
    }
    let constant =
        |x: [f64; 3]| Twist { velocity: [S::constant(x[0]), S::constant(x[1])], rotation: S::constant(x[2]) };
    // One Newton step in `S` carries the derivatives (implicit function theorem).
    let inverse = if S::DIFFERENTIATES { inverse3(w.map(|d| d.d)) } else { None };
    let Some(inverse) = inverse else { return constant(x) };
    let w = support.demand(&constant(x));
    let residual = [w.force[0], w.force[1], w.moment];
    let corrected = [0, 1, 2].map(|i| {
        let correction =
            residual[0] * inverse[i][0] + residual[1] * inverse[i][1] + residual[2] * inverse[i][2];
        S::constant(x[i]) - correction
    });
    Twist { velocity: [corrected[0], corrected[1]], rotation: corrected[2] }
}

/// Inverse of a 3 x 3 matrix; `None` if it is singular.
fn inverse3(m: [[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let minor = |i: usize, j: usize| {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        let (c, d) = ((j + 1) % 3, (j + 2) % 3);
        m[a][c] * m[b][d] - m[a][d] * m[b][c]
    };
    let determinant: f64 = (0..3).map(|j| m[0][j] * minor(0, j)).sum();
    if determinant == 0.0 || !determinant.is_finite() {
        return None;
    }
    Some([0, 1, 2].map(|i| [0, 1, 2].map(|j| minor(j, i) / determinant)))
}

/// Solution x of the 3 x 3 system `m x = b`; `None` if the matrix is singular.
fn solve3(m: [[f64; 3]; 3], b: [f64; 3]) -> Option<[f64; 3]> {
    let inverse = inverse3(m)?;
    Some([0, 1, 2].map(|i| (0..3).map(|j| inverse[i][j] * b[j]).sum()))
}

/// Mobility `B⁻¹ + r⊥ r⊥ᵀ / c²` of an ellipsoidal support: contact velocity per contact force.
///
/// `r` is the position of the contact seen from the centre of friction.
pub(super) fn mobility<S: Scalar>(inverse_metric: &Matrix<S>, c: S, r: Vector<S>) -> Matrix<S> {
    let arm = rot90(r);
    let k = S::constant(1.0) / (c * c);
    let off = inverse_metric[0][1] + arm[0] * arm[1] * k;
    [[inverse_metric[0][0] + arm[0] * arm[0] * k, off], [off, inverse_metric[1][1] + arm[1] * arm[1] * k]]
}

#[cfg(test)]
mod tests {
    //! Contract: an object without a rod moves so that friction and inertia balance, also where friction depends on
    //! the speed and so has no simple potential.

    use super::*;
    use crate::push::outline::Outline;
    use crate::push::surface::patches::{SpeedLaw, cut};
    use crate::push::surface::uniform::UniformPolygon;

    /// Largest residual of the equation of motion, in units of the sliding force, after steps of 1 ms from motions of 1 mm/s
    /// to 1 m/s, each with four rates of rotation.
    fn largest_residual(surface: Surface<'_, f64>) -> f64 {
        let mut support = Support::plain(surface);
        let mut residual = |size: f64, turns: f64| {
            let previous = Twist { velocity: [0.9 * size, -0.4 * size], rotation: turns * size };
            support.inertia = Some(Inertia { mass: 400.0, moment: 0.5, previous });
            let w = support.demand(&free_twist(&support));
            norm(w.force).max(w.moment.abs() / surface.nominal_c())
        };
        let sizes = (0..=60).map(|n| 10f64.powf(f64::from(n) / 20.0 - 3.0));
        sizes.flat_map(|size| [0.0, 1.0, 30.0, -300.0].map(|turns| residual(size, turns))).fold(0.0, f64::max)
    }

    #[test]
    fn free_motion_balances_friction_and_inertia() {
        let outline = Outline::Ellipse { semi_axes_m: [0.05, 0.03] };
        let patches = cut(&outline, 10);
        let shares: Vec<f64> = patches.iter().map(|p| p.share).collect();
        let footprint = UniformPolygon::new(&outline.polygon(24));
        let by_speed = |rise: Option<f64>| {
            let speed = rise.map(|rise| SpeedLaw { rise, speed_m_s: 0.03 });
            Surface::Patches { patches: &patches, weights: &shares, scale: 1.0, speed }
        };
        let surfaces = [
            Surface::Ellipsoid { c: 0.03 },
            Surface::Superellipsoid { c: 0.03, exponent: 1.6 },
            Surface::Uniform { footprint: &footprint, scale: 1.0 },
            by_speed(None),
            by_speed(Some(0.5)),
            by_speed(Some(-0.3)),
        ];
        for (number, surface) in surfaces.into_iter().enumerate() {
            let residual = largest_residual(surface);
            assert!(residual < 1e-9, "surface {number}: {residual:e}");
        }
    }
}
