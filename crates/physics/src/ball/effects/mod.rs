//! The library of ball effects: one file per effect, registered here.
//!
//! To add one, write `effects/my_effect.rs` like the existing files (a unit struct, a `static SPEC`, and the
//! hooks of [`Law`] that it needs), declare the module and add one line to the registry below. Model files,
//! search, reports and the tests over all effects read the registry.

mod law;
mod scatter;
mod table;

mod camera_roll;
mod contact_duration;
mod coulomb_friction;
mod drag_coefficient;
mod grip_friction;
mod ground_tilt;
mod height_offset;
mod horizontal_acceleration;
mod latency;
mod lateral_acceleration;
mod linear_drag;
mod magnus;
mod quadratic_drag;
mod restitution_drift;
mod restitution_position;
mod restitution_speed_linear;
mod restitution_speed_power;
mod spin_misalignment;
mod spin_offset;
mod vertical_acceleration;
mod wind;

use crate::library::registry::registry;

pub use law::{Effect, Flight, Law, Measurement};
pub use scatter::{SCATTER_KIND, SCATTER_SPEC, scatter_word};
pub use table::{Feature, TABLE_KIND, Table, Target};

// Effects on the restitution act in this order: additive ones first, then multiplicative ones, since the two
// do not commute. The engine adds the random scatter last.
registry! {
    unlisted SCATTER_KIND, TABLE_KIND;
    quadratic_drag::QuadraticDrag,
    drag_coefficient::DragCoefficient,
    linear_drag::LinearDrag,
    vertical_acceleration::VerticalAcceleration,
    horizontal_acceleration::HorizontalAcceleration,
    lateral_acceleration::LateralAcceleration,
    magnus::Magnus,
    wind::Wind,
    restitution_speed_linear::RestitutionSpeedLinear,
    restitution_drift::RestitutionDrift,
    restitution_position::RestitutionPosition,
    restitution_speed_power::RestitutionSpeedPower,
    coulomb_friction::CoulombFriction,
    grip_friction::GripFriction,
    ground_tilt::GroundTilt,
    contact_duration::ContactDuration,
    spin_misalignment::SpinMisalignment,
    spin_offset::SpinOffset,
    camera_roll::CameraRoll,
    height_offset::HeightOffset,
    latency::Latency,
}
