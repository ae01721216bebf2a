//! Quantities that determine the mechanics of one push, with parameter values filled in.

use super::planar::{Rotation, Vector, add, scale};
use super::surface::patches::SpeedLaw;
use crate::Scalar;

/// Gravitational acceleration, m/s².
pub const GRAVITY_M_S2: f64 = 9.81;

/// Form of the limit surface, that is, of the friction between object and support.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction<S> {
    /// Ellipsoidal limit surface `|f|² + (m/c)² = 1` for force f and moment m.
    Ellipsoid,
    /// Superellipsoidal limit surface with this exponent.
    Superellipsoid(S),
    /// Coulomb friction integrated over a uniformly pressed outline, in closed form.
    Uniform,
    /// Coulomb friction integrated over the outline as a sum over patches.
    Patches,
}

/// Anisotropic friction: sliding with velocity v dissipates `D = |A^½ v|` instead of `|v|`.
///
/// `A = R diag(ratio, 1/ratio) Rᵀ`, R the rotation by `angle_rad`; D is per unit sliding force.
#[derive(Clone, Copy, Debug)]
pub struct Anisotropy<S> {
    /// Ratio of friction along the direction `angle_rad` to friction across it.
    pub ratio: S,
    /// Angle from the x axis to the direction of largest friction (for ratio > 1), rad, counter-clockwise.
    pub angle_rad: S,
}

/// Similarity transform of rod positions between two coordinate frames: scale, rotation and offset.
#[derive(Clone, Copy, Debug)]
pub struct Registration<S> {
    rotation: Rotation<S>,
    factor: S,
    offset_m: Vector<S>,
}

impl<S: Scalar> Registration<S> {
    /// The transform that scales by `1 + scale`, rotates by `angle_rad` and adds `offset_m`.
    ///
    /// The rotation is about the origin.
    pub fn new(scale: S, angle_rad: S, offset_m: Vector<S>) -> Self {
        Self { rotation: Rotation::new(angle_rad), factor: scale + 1.0, offset_m }
    }

    /// Transforms a reported rod position, m.
    pub fn position(&self, reported: Vector<S>) -> Vector<S> {
        add(self.velocity(reported), self.offset_m)
    }

    /// Transforms a reported rod velocity, m/s.
    pub fn velocity(&self, reported: Vector<S>) -> Vector<S> {
        scale(self.rotation.to_world(reported), self.factor)
    }
}

/// Mechanics of one push: base parameters, and one field for each quantity that an effect changes.
#[derive(Clone, Copy, Debug)]
pub struct Setting<S> {
    /// Ratio `c` of largest moment to largest force of the limit surface, m; scales integrated surfaces.
    pub c_m: S,
    /// Coefficient of friction between rod and object.
    pub contact_friction: S,
    /// Radius of the rod, m.
    pub rod_radius_m: S,
    /// Coefficient of friction between object and support.
    pub support_friction: S,
    /// Mass of the object, kg.
    pub mass_kg: S,
    /// Form of the limit surface of the support.
    pub friction: Friction<S>,
    /// Centre of pressure relative to the centroid, body frame, m; `None` if it is the centroid.
    pub pressure_offset_m: Option<Vector<S>>,
    /// Height of the contact above the support, m; `None` if its effect is neglected.
    pub push_height_m: Option<S>,
    /// Anisotropic friction whose direction is fixed to the table; `None` if there is none.
    pub table_anisotropy: Option<Anisotropy<S>>,
    /// Anisotropic friction whose direction is fixed to the object; `None` if there is none.
    pub object_anisotropy: Option<Anisotropy<S>>,
    /// Relative change of the support's friction per distance, world frame, 1/m; `None` if uniform.
    pub friction_gradient_per_m: Option<Vector<S>>,
    /// Dependence of the support's friction on the sliding speed; `None` if it does not depend on it.
    pub speed: Option<SpeedLaw<S>>,
    /// Rise `k` of the contact friction with the slip speed, s/m, in `mu (1 + k |slip|)`; `None` for 0.
    pub slip_rise_s_per_m: Option<S>,
    /// Offset of the true rod position from the reported one, world frame, m; `None` if there is none.
    pub tip_offset_m: Option<Vector<S>>,
    /// Transform from the frame in which the rod is reported to that of the object; `None` if equal.
    pub registration: Option<Registration<S>>,
    /// Deflection of the rod per contact force, m/N; `None` for a rigid rod.
    pub compliance_m_per_n: Option<S>,
    /// Offset of the reported pose from the true one: position in the body frame, m, and angle, rad.
    pub pose_offset: Option<(Vector<S>, S)>,
    /// Delay of the reported pose, s; `None` if there is none.
    pub delay_s: Option<S>,
    /// Tangent of the table's tilt times the unit vector downhill, world frame; `None` if level.
    pub downhill: Option<Vector<S>>,
    /// Fraction of the mass that has inertia: 1 for Newton's law, `None` for quasi-static motion.
    pub inertia: Option<S>,
}

impl<S: Scalar> Setting<S> {
    /// Mechanics with the ellipsoidal limit surface and no effects.
    pub fn plain(c_m: S, contact_friction: S, rod_radius_m: S, support_friction: S, mass_kg: S) -> Self {
        Self {
            c_m,
            contact_friction,
            rod_radius_m,
            support_friction,
            mass_kg,
            friction: Friction::Ellipsoid,
            pressure_offset_m: None,
            push_height_m: None,
            table_anisotropy: None,
            object_anisotropy: None,
            friction_gradient_per_m: None,
            speed: None,
            slip_rise_s_per_m: None,
            tip_offset_m: None,
            registration: None,
            compliance_m_per_n: None,
            pose_offset: None,
            delay_s: None,
            downhill: None,
            inertia: None,
        }
    }

    /// Friction force of the sliding object `mu_s m g`, N.
    pub fn sliding_force_n(&self) -> S {
        self.support_friction * self.mass_kg * GRAVITY_M_S2
    }
}
