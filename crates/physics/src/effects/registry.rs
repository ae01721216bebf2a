//! The list of effects. Adding an effect is one file and one line here.

use super::{Effect, EffectSpec, SCATTER_KIND, SCATTER_SPEC, TABLE_KIND};
use crate::Scalar;

macro_rules! registry {
    ($($file:literal $module:ident $effect:ident)*) => {
        $(#[path = $file] mod $module;)*
        const COUNT: usize = [$(stringify!($effect)),*].len();

        /// All effects, in the order in which they act.
        pub fn all<S: Scalar>() -> [&'static dyn Effect<S>; COUNT] {
            [$(&$module::$effect),*]
        }
    };
}

// Laws of restitution act in this order: additive ones first, then multiplicative ones; scatter is added last by the engine.
registry! {
    "quadratic_drag.rs" quadratic_drag QuadraticDrag
    "drag_coefficient.rs" drag_coefficient DragCoefficient
    "linear_drag.rs" linear_drag LinearDrag
    "vertical_acceleration.rs" vertical_acceleration VerticalAcceleration
    "horizontal_acceleration.rs" horizontal_acceleration HorizontalAcceleration
    "lateral_acceleration.rs" lateral_acceleration LateralAcceleration
    "magnus.rs" magnus Magnus
    "wind.rs" wind Wind
    "restitution_speed_linear.rs" restitution_speed_linear RestitutionSpeedLinear
    "restitution_drift.rs" restitution_drift RestitutionDrift
    "restitution_position.rs" restitution_position RestitutionPosition
    "restitution_speed_power.rs" restitution_speed_power RestitutionSpeedPower
    "coulomb_friction.rs" coulomb_friction CoulombFriction
    "grip_friction.rs" grip_friction GripFriction
    "ground_tilt.rs" ground_tilt GroundTilt
    "contact_duration.rs" contact_duration ContactDuration
    "spin_misalignment.rs" spin_misalignment SpinMisalignment
    "camera_roll.rs" camera_roll CameraRoll
    "height_offset.rs" height_offset HeightOffset
    "latency.rs" latency Latency
}

/// Position of a kind in [`all`], the order in which effects act.
pub fn index_of(kind: &str) -> Option<usize> {
    all::<f64>().iter().position(|e| e.spec().kind == kind)
}

/// The description of a kind, the scatter of restitution included.
pub fn spec_of(kind: &str) -> Option<&'static EffectSpec> {
    if kind == SCATTER_KIND {
        return Some(&SCATTER_SPEC);
    }
    all::<f64>().into_iter().map(|e| e.spec()).find(|s| s.kind == kind)
}

/// The known kind that is spelt most like `kind`.
pub fn nearest_kind(kind: &str) -> &'static str {
    all::<f64>()
        .into_iter()
        .map(|e| e.spec().kind)
        .chain([SCATTER_KIND, TABLE_KIND])
        .min_by_key(|known| crate::model::edit_distance(kind, known))
        .unwrap_or(TABLE_KIND)
}
