//! Limit surfaces: the friction of the support against a sliding object.
//!
//! Every surface answers one question, [`Surface::wrench`]: which friction, in units of the sliding force `mu_s m g`, does the
//! support exert against a given twist? By the principle of maximum dissipation the answer is the gradient of the dissipation
//! `D(v, ω)`, which is convex and homogeneous of degree one (Goyal, Ruina and Papadopoulos, Wear 143:307, 1991), so that
//! contact can be solved for all surfaces by the same means.

pub mod ellipsoid;
pub mod patches;
pub mod quartic;
mod sloped;
pub mod superellipsoid;
pub mod uniform;

use super::planar::{Vector, Wrench, rot90};
use crate::Scalar;
use patches::{Patch, SpeedLaw};
use quartic::Quartic;
use uniform::UniformPolygon;

/// A linear map of the plane, by rows.
pub type Matrix<S> = [[S; 2]; 2];

/// A limit surface about the centre of friction.
#[derive(Clone, Copy, Debug)]
pub enum Surface<'a, S> {
    /// `|f|² + (m/c)² = 1`.
    Ellipsoid {
        /// Ratio of the largest moment to the largest force, m.
        c: S,
    },
    /// `|f|^p + |m/c|^p = 1`.
    Superellipsoid {
        /// Ratio of the largest moment to the largest force, m.
        c: S,
        /// The exponent p, above 1.
        exponent: S,
    },
    /// A level set of a convex polynomial of the fourth degree.
    Quartic {
        /// The polynomial.
        quartic: &'a Quartic,
    },
    /// Coulomb friction integrated over a uniformly pressed polygon, in closed form.
    Uniform {
        /// The footprint.
        footprint: &'a UniformPolygon,
        /// Factor on all lengths of the footprint.
        scale: S,
    },
    /// Coulomb friction summed over patches.
    Patches {
        /// The patches.
        patches: &'a [Patch],
        /// Share of each patch in the sliding force; the shares sum to 1 where friction is what is declared.
        weights: &'a [f64],
        /// Factor on all lengths of the footprint.
        scale: S,
        /// Friction that depends on the sliding speed.
        speed: Option<SpeedLaw<S>>,
    },
}

impl<'a, S: Scalar> Surface<'a, S> {
    /// Force and moment that keep the footprint moving with `velocity` (of the centre of friction, m/s) and `rotation`, rad/s.
    ///
    /// `map` stretches the footprint, for anisotropic friction. Zero for no motion.
    #[inline]
    pub fn wrench(&self, velocity: Vector<S>, rotation: S, map: Option<&Matrix<S>>) -> Wrench<S> {
        match self {
            Surface::Ellipsoid { c } => ellipsoid::wrench(*c, velocity, rotation),
            Surface::Superellipsoid { c, exponent } => {
                superellipsoid::wrench(*c, *exponent, velocity, rotation)
            }
            Surface::Quartic { quartic } => {
                let inputs = [velocity[0], velocity[1], rotation];
                quartic.sloped(inputs.map(S::value)).through(inputs)
            }
            Surface::Uniform { footprint, scale } => {
                let turning = rotation * *scale;
                let mut w = match map {
                    None if S::DIFFERENTIATES => {
                        let inputs = [velocity[0], velocity[1], turning];
                        footprint.sloped(inputs.map(S::value)).through(inputs)
                    }
                    _ => footprint.wrench(velocity, turning, map),
                };
                w.moment = w.moment * *scale;
                w
            }
            Surface::Patches { patches, weights, scale, speed } => {
                let turning = rotation * *scale;
                let mut w = match (map, speed) {
                    (None, None) if S::DIFFERENTIATES => {
                        let inputs = [velocity[0], velocity[1], turning];
                        patches::sloped(patches, weights, inputs.map(S::value)).through(inputs)
                    }
                    (None, Some(law)) if S::DIFFERENTIATES => {
                        let inputs = [velocity[0], velocity[1], turning, law.rise, law.speed_m_s];
                        patches::sloped_by_speed(patches, weights, inputs.map(S::value)).through(inputs)
                    }
                    _ => patches::wrench(patches, weights, velocity, turning, map, speed.as_ref()),
                };
                w.moment = w.moment * *scale;
                w
            }
        }
    }

    /// Copies the surface in another scalar.
    pub fn map<T: Scalar>(&self, f: impl Fn(S) -> T) -> Surface<'a, T> {
        match *self {
            Surface::Ellipsoid { c } => Surface::Ellipsoid { c: f(c) },
            Surface::Superellipsoid { c, exponent } => {
                Surface::Superellipsoid { c: f(c), exponent: f(exponent) }
            }
            Surface::Quartic { quartic } => Surface::Quartic { quartic },
            Surface::Uniform { footprint, scale } => Surface::Uniform { footprint, scale: f(scale) },
            Surface::Patches { patches, weights, scale, speed } => Surface::Patches {
                patches,
                weights,
                scale: f(scale),
                speed: speed.map(|s| SpeedLaw { rise: f(s.rise), speed_m_s: f(s.speed_m_s) }),
            },
        }
    }

    /// The `c` of an ellipsoid like this surface, m: where to start looking for a twist.
    pub fn nominal_c(&self) -> f64 {
        match self {
            Surface::Ellipsoid { c } | Surface::Superellipsoid { c, .. } => c.value(),
            Surface::Quartic { quartic } => quartic.nominal_c(),
            Surface::Uniform { footprint, scale } => footprint.mean_radius() * scale.value(),
            Surface::Patches { patches, scale, .. } => {
                let square =
                    patches.iter().map(|p| p.share * (p.position[0].powi(2) + p.position[1].powi(2)));
                (0.9 * square.sum::<f64>()).sqrt() * scale.value()
            }
        }
    }
}

/// `M a`.
#[inline(always)]
pub(super) fn apply<S: Scalar>(m: &Matrix<S>, a: Vector<S>) -> Vector<S> {
    [m[0][0] * a[0] + m[0][1] * a[1], m[1][0] * a[0] + m[1][1] * a[1]]
}

/// `Mᵀ a`.
#[inline(always)]
pub(super) fn apply_transposed<S: Scalar>(m: &Matrix<S>, a: Vector<S>) -> Vector<S> {
    [m[0][0] * a[0] + m[1][0] * a[1], m[0][1] * a[0] + m[1][1] * a[1]]
}

/// `J⁻¹ M J` with J the rotation by 90 degrees: how the footprint is stretched when velocities are by `M`.
pub(super) fn footprint_map<S: Scalar>(m: &Matrix<S>) -> Matrix<S> {
    // Columns: J⁻¹ M J e_x and J⁻¹ M J e_y; J⁻¹ = -J.
    let one = S::constant(1.0);
    let column = |e: Vector<S>| rot90(apply(m, rot90(e))).map(|x| -x);
    let (x, y) = (column([one, S::zero()]), column([S::zero(), one]));
    [[x[0], y[0]], [x[1], y[1]]]
}
