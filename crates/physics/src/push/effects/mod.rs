//! The library of effects of pushing: one file per effect, registered here by name.
//!
//! To add one, write `effects/my_effect.rs` like its neighbours (a unit struct, a `static SPEC`, and the
//! field of [`Setting`] that it sets), declare the module, and add one line to the registry below. Model
//! files and the tests over the registry then find it.

mod scatter;

mod contact_friction_slip;
mod exact_surface;
mod frame_registration;
mod friction_gradient;
mod inertia;
mod object_anisotropy;
mod pose_latency;
mod pose_offset;
mod pressure_offset;
mod push_height;
mod rod_compliance;
mod speed_dependent_friction;
mod superelliptic_surface;
mod table_anisotropy;
mod table_tilt;
mod tip_offset;

use super::setting::Setting;
use crate::Scalar;
use crate::library::EffectSpec;
use crate::library::registry::registry;

pub use scatter::{SCATTER_KIND, SCATTER_SPEC};

/// A named effect: a change of the [`Setting`] of a push, with its description.
pub trait Effect<S: Scalar>: Send + Sync {
    /// Description of the effect: kind, place, parameters with units, sources.
    fn spec(&self) -> &'static EffectSpec;
    /// Sets the fields of `setting` that the effect changes; `p` holds its parameters in order.
    fn apply(&self, p: &[S], setting: &mut Setting<S>);
}

registry! {
    unlisted SCATTER_KIND;
    superelliptic_surface::SuperellipticSurface,
    exact_surface::ExactSurface,
    pressure_offset::PressureOffset,
    push_height::PushHeight,
    table_anisotropy::TableAnisotropy,
    object_anisotropy::ObjectAnisotropy,
    friction_gradient::FrictionGradient,
    speed_dependent_friction::SpeedDependentFriction,
    contact_friction_slip::ContactFrictionSlip,
    tip_offset::TipOffset,
    frame_registration::FrameRegistration,
    rod_compliance::RodCompliance,
    pose_offset::PoseOffset,
    pose_latency::PoseLatency,
    table_tilt::TableTilt,
    inertia::Inertia,
}
