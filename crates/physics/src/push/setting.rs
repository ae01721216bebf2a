//! Everything that determines the mechanics of one push, with parameter values filled in.

use super::planar::{Rotation, Vector, add, scale};
use super::surface::patches::SpeedLaw;
use crate::Scalar;

/// Gravitational acceleration, m/s².
pub const GRAVITY_M_S2: f64 = 9.81;

/// Form of the limit surface of the support.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction<S> {
    /// Ellipsoid `|f|² + (m/c)² = 1`.
    Ellipsoid,
    /// Superellipsoid with this exponent.
    Superellipsoid(S),
    /// Integrated Coulomb friction of a uniformly pressed outline, in closed form.
    Uniform,
    /// Integrated Coulomb friction, as a sum over patches.
    Patches,
}

/// Anisotropic friction: `D = |A^½ v|`, `A = R diag(ratio, 1/ratio) Rᵀ`.
#[derive(Clone, Copy, Debug)]
pub struct Anisotropy<S> {
    /// Ratio of friction along the direction to friction across it.
    pub ratio: S,
    /// Angle of the direction, rad.
    pub angle_rad: S,
}

/// Similarity transform between two coordinate frames: scale, rotation and offset.
#[derive(Clone, Copy, Debug)]
pub struct Registration<S> {
    rotation: Rotation<S>,
    factor: S,
    offset_m: Vector<S>,
}

impl<S: Scalar> Registration<S> {
    /// The transform that scales by `1 + scale`, rotates by `angle_rad` about the origin and adds `offset_m`.
    pub fn new(scale: S, angle_rad: S, offset_m: Vector<S>) -> Self {
        Self { rotation: Rotation::new(angle_rad), factor: scale + 1.0, offset_m }
    }

    /// Transforms a reported position, m.
    pub fn position(&self, reported: Vector<S>) -> Vector<S> {
        add(self.velocity(reported), self.offset_m)
    }

    /// Transforms a reported velocity, m/s.
    pub fn velocity(&self, reported: Vector<S>) -> Vector<S> {
        scale(self.rotation.to_world(reported), self.factor)
    }
}

/// Mechanics of one push: base parameters, and one field for each thing that an effect can change.
#[derive(Clone, Copy, Debug)]
pub struct Setting<S> {
    /// `c` of the limit surface, m; for integrated surfaces the footprint is scaled to have it.
    pub c_m: S,
    /// Coefficient of friction between rod and object.
    pub contact_friction: S,
    /// Radius of the rod, m.
    pub rod_radius_m: S,
    /// Coefficient of friction between object and support.
    pub support_friction: S,
    /// Mass of the object, kg.
    pub mass_kg: S,
    /// Form of the limit surface.
    pub friction: Friction<S>,
    /// Centre of pressure seen from the centroid, body frame, m.
    pub pressure_offset_m: Option<Vector<S>>,
    /// Height of the contact above the support, m.
    pub push_height_m: Option<S>,
    /// Anisotropy fixed to the table.
    pub table_anisotropy: Option<Anisotropy<S>>,
    /// Anisotropy fixed to the object.
    pub object_anisotropy: Option<Anisotropy<S>>,
    /// Relative change of the support's friction per distance, world frame, 1/m.
    pub friction_gradient_per_m: Option<Vector<S>>,
    /// Dependence of the support's friction on the sliding speed.
    pub speed: Option<SpeedLaw<S>>,
    /// Rise of the contact's friction with the slip speed, s/m: `mu (1 + k |slip|)`.
    pub slip_rise_s_per_m: Option<S>,
    /// Offset of the true rod position from the reported one, world frame, m.
    pub tip_offset_m: Option<Vector<S>>,
    /// Transform from the frame in which the rod is reported to that of the object.
    pub registration: Option<Registration<S>>,
    /// Deflection of the rod per force, m/N.
    pub compliance_m_per_n: Option<S>,
    /// Offset of the reported pose from the true one: in the body frame, m, and rad.
    pub pose_offset: Option<(Vector<S>, S)>,
    /// Delay of the reported pose, s.
    pub delay_s: Option<S>,
    /// Tangent of the table's tilt times the unit vector downhill, world frame.
    pub downhill: Option<Vector<S>>,
    /// Fraction of the mass that has inertia: 1 for Newton's law, `None` for quasi-static motion.
    pub inertia: Option<S>,
}

impl<S: Scalar> Setting<S> {
    /// The setting with the ellipsoidal limit surface and no effects.
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

    /// Friction force of the sliding object, N.
    pub fn sliding_force_n(&self) -> S {
        self.support_friction * self.mass_kg * GRAVITY_M_S2
    }
}
