//! The laws of one push with their numbers filled in.

use super::planar::{Rotation, Vector, add, scale};
use super::surface::patches::SpeedLaw;
use crate::Scalar;

/// Standard gravity, m/s².
pub const GRAVITY_M_S2: f64 = 9.81;

/// Which limit surface the support has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction<S> {
    /// Ellipsoid.
    Ellipsoid,
    /// Superellipsoid with this exponent.
    Superellipsoid(S),
    /// Integrated Coulomb friction of a uniformly pressed outline, in closed form.
    Uniform,
    /// Integrated Coulomb friction, by patches.
    Patches,
}

/// Friction that differs by direction: `D = |A^½ v|`, `A = R diag(ratio, 1/ratio) Rᵀ`.
#[derive(Clone, Copy, Debug)]
pub struct Anisotropy<S> {
    /// Friction along the direction over friction across it.
    pub ratio: S,
    /// The direction, rad.
    pub angle_rad: S,
}

/// A similarity that takes what one frame reports to another.
#[derive(Clone, Copy, Debug)]
pub struct Registration<S> {
    turn: Rotation<S>,
    factor: S,
    offset_m: Vector<S>,
}

impl<S: Scalar> Registration<S> {
    /// Scaled by `1 + scale`, turned by `angle_rad` about the origin and moved by `offset_m`.
    pub fn new(scale: S, angle_rad: S, offset_m: Vector<S>) -> Self {
        Self { turn: Rotation::new(angle_rad), factor: scale + 1.0, offset_m }
    }

    /// A position, m.
    pub fn position(&self, reported: Vector<S>) -> Vector<S> {
        add(self.velocity(reported), self.offset_m)
    }

    /// A velocity, m/s.
    pub fn velocity(&self, reported: Vector<S>) -> Vector<S> {
        scale(self.turn.to_world(reported), self.factor)
    }
}

/// Everything that decides how an object responds to the rod. Effects fill in what they change.
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
    /// Which limit surface.
    pub friction: Friction<S>,
    /// Centre of pressure from the centroid, in the body, m.
    pub pressure_offset_m: Option<Vector<S>>,
    /// Height of the contact above the support, m.
    pub push_height_m: Option<S>,
    /// Anisotropy fixed to the table.
    pub table_anisotropy: Option<Anisotropy<S>>,
    /// Anisotropy fixed to the object.
    pub object_anisotropy: Option<Anisotropy<S>>,
    /// Relative change of the support's friction per metre, in the world, 1/m.
    pub friction_gradient_per_m: Option<Vector<S>>,
    /// Friction of the support that falls with the sliding speed.
    pub speed: Option<SpeedLaw<S>>,
    /// Rise of the contact's friction with the slip speed, s/m: `mu (1 + k |slip|)`.
    pub slip_rise_s_per_m: Option<S>,
    /// True rod from where it is reported, in the world, m.
    pub tip_offset_m: Option<Vector<S>>,
    /// The frame in which the rod is reported, seen from that of the object.
    pub registration: Option<Registration<S>>,
    /// Deflection of the rod per force, m/N.
    pub compliance_m_per_n: Option<S>,
    /// Reported object from where it is: in the body, m, and rad.
    pub pose_offset: Option<(Vector<S>, S)>,
    /// Age of the reported pose, s.
    pub delay_s: Option<S>,
    /// `tan` of the table's tilt times the downhill direction, in the world.
    pub downhill: Option<Vector<S>>,
    /// Share of the mass that has inertia: 1 for Newton's law, absent for quasi-static motion.
    pub inertia: Option<S>,
}

impl<S: Scalar> Setting<S> {
    /// Nothing but the ellipsoid.
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
