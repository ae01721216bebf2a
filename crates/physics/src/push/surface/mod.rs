//! Limit surfaces: friction force and moment of the support on a sliding object.
//!
//! [`Surface::wrench`] returns the friction, in units of the sliding force `mu_s m g`, that the support
//! exerts against a given twist. By the principle of maximum dissipation it is the gradient of the
//! dissipation `D(v, ω)`, which is convex and homogeneous of degree one (Goyal, Ruina and Papadopoulos, Wear
//! 143:307, 1991). Contacts can therefore be solved in the same way for all surfaces.

mod decay;
pub mod ellipsoid;
pub mod patches;
pub mod quartic;
pub mod superellipsoid;
pub mod uniform;
mod wrench_jacobian;

use super::planar::{Vector, Wrench, rot90};
use crate::Scalar;
use patches::{Patch, SpeedLaw};
use quartic::Quartic;
use uniform::UniformPolygon;

/// A linear map of the plane, stored by rows.
pub type Matrix<S> = [[S; 2]; 2];

/// A limit surface: the friction wrenches of a sliding object, about the centre of friction.
#[derive(Clone, Copy, Debug)]
pub enum Surface<'a, S> {
    /// Ellipsoidal limit surface `|f|² + (m/c)² = 1` for force f and moment m.
    Ellipsoid {
        /// Ratio `c` of the largest moment to the largest force, m.
        c: S,
    },
    /// Superellipsoidal limit surface `|f|^p + |m/c|^p = 1` for force f and moment m.
    Superellipsoid {
        /// Ratio `c` of the largest moment to the largest force, m.
        c: S,
        /// Exponent p of the limit surface `|f|^p + |m/c|^p = 1`, above 1.
        exponent: S,
    },
    /// Limit surface that is a level set of a convex polynomial of the fourth degree.
    Quartic {
        /// Polynomial whose level set is the limit surface.
        quartic: &'a Quartic,
    },
    /// Coulomb friction integrated over a uniformly pressed polygon, in closed form.
    Uniform {
        /// Uniformly pressed polygon on which the object rests.
        footprint: &'a UniformPolygon,
        /// Factor by which all lengths of the footprint are multiplied.
        scale: S,
    },
    /// Coulomb friction summed over patches of the footprint.
    Patches {
        /// Patches of the footprint of the object.
        patches: &'a [Patch],
        /// Share of each patch in the sliding force; the shares sum to 1 if the mean friction is the declared
        /// one.
        weights: &'a [f64],
        /// Factor by which all lengths of the footprint are multiplied.
        scale: S,
        /// Dependence of friction on the sliding speed; `None` if it does not depend on it.
        speed: Option<SpeedLaw<S>>,
    },
}

impl<'a, S: Scalar> Surface<'a, S> {
    /// Force and moment, in units of the sliding force, that keep the footprint in motion against friction.
    ///
    /// The motion has `velocity`, m/s, and `rotation`, rad/s.
    ///
    /// `velocity` is that of the centre of friction. `map` stretches the footprint, for anisotropic friction.
    /// The wrench is zero at rest.
    #[inline]
    pub fn wrench(&self, velocity: Vector<S>, rotation: S, map: Option<&Matrix<S>>) -> Wrench<S> {
        match self {
            Surface::Ellipsoid { c } => ellipsoid::wrench(*c, velocity, rotation),
            Surface::Superellipsoid { c, exponent } => {
                superellipsoid::wrench(*c, *exponent, velocity, rotation)
            }
            Surface::Quartic { quartic } => {
                let inputs = [velocity[0], velocity[1], rotation];
                quartic.wrench_with_jacobian(inputs.map(S::value)).chain_rule(inputs)
            }
            Surface::Uniform { footprint, scale } => {
                let turning = rotation * *scale;
                let mut w = match map {
                    None if S::DIFFERENTIATES => {
                        let inputs = [velocity[0], velocity[1], turning];
                        footprint.wrench_with_jacobian(inputs.map(S::value)).chain_rule(inputs)
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
                        patches::wrench_with_jacobian(patches, weights, inputs.map(S::value))
                            .chain_rule(inputs)
                    }
                    (None, Some(law)) if S::DIFFERENTIATES => {
                        let inputs = [velocity[0], velocity[1], turning, law.rise, law.speed_m_s];
                        patches::wrench_with_jacobian_by_speed(patches, weights, inputs.map(S::value))
                            .chain_rule(inputs)
                    }
                    (Some([[xx, xy], [yx, yy]]), law) if S::DIFFERENTIATES => {
                        let plain = SpeedLaw { rise: S::zero(), speed_m_s: S::constant(1.0) };
                        let SpeedLaw { rise, speed_m_s } = law.unwrap_or(plain);
                        let [x, y] = velocity;
                        let inputs = [x, y, turning, rise, speed_m_s, *xx, *xy, *yx, *yy];
                        let values = inputs.map(S::value);
                        patches::wrench_with_jacobian_of_map(patches, weights, values, law.is_some())
                            .chain_rule(inputs)
                    }
                    _ => patches::wrench(patches, weights, velocity, turning, map, speed.as_ref()),
                };
                w.moment = w.moment * *scale;
                w
            }
        }
    }

    /// Converts the numbers of the surface to another scalar with `f`.
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

    /// Ratio `c` of an ellipsoid that approximates this limit surface, m; used for initial guesses.
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

/// Product of the matrix `m` and the vector `a`.
#[inline(always)]
pub(super) fn apply<S: Scalar>(m: &Matrix<S>, a: Vector<S>) -> Vector<S> {
    [m[0][0] * a[0] + m[0][1] * a[1], m[1][0] * a[0] + m[1][1] * a[1]]
}

/// Product `Mᵀ a` of the transposed matrix and a vector.
#[inline(always)]
pub(super) fn apply_transposed<S: Scalar>(m: &Matrix<S>, a: Vector<S>) -> Vector<S> {
    [m[0][0] * a[0] + m[1][0] * a[1], m[0][1] * a[0] + m[1][1] * a[1]]
}

/// The map `J⁻¹ M J` of the footprint that corresponds to the map `M` of velocities; `J` rotates by 90
/// degrees.
///
/// The arm of a point enters the velocity rotated by 90 degrees, hence the conjugation.
pub(super) fn footprint_map<S: Scalar>(m: &Matrix<S>) -> Matrix<S> {
    // The columns are J⁻¹ M J e_x and J⁻¹ M J e_y, with J⁻¹ = -J.
    let one = S::constant(1.0);
    let column = |e: Vector<S>| rot90(apply(m, rot90(e))).map(|x| -x);
    let (x, y) = (column([one, S::zero()]), column([S::zero(), one]));
    [[x[0], y[0]], [x[1], y[1]]]
}
