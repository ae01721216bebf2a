//! The library of effects of pushing: one file per effect, registered here by name.
//!
//! To add one: write `effects/my_effect.rs` on the pattern of its neighbours (a unit struct, a `static SPEC`, the field of
//! [`Setting`] that it fills in), then add one line to the registry below. Model files and the tests that run over the registry
//! find it there.

mod scatter;

use super::setting::Setting;
use crate::Scalar;
use crate::effects::EffectSpec;

pub use scatter::{SCATTER_KIND, SCATTER_SPEC};

/// A named effect: a change of the [`Setting`] of a push, with its description.
pub trait Effect<S: Scalar>: Send + Sync {
    /// Its description.
    fn spec(&self) -> &'static EffectSpec;
    /// Fills in what the effect changes; `p` holds its parameters in the order of its [`EffectSpec`].
    fn apply(&self, p: &[S], setting: &mut Setting<S>);
}

macro_rules! registry {
    ($($module:ident $effect:ident)*) => {
        $(mod $module;)*
        const COUNT: usize = [$(stringify!($effect)),*].len();

        /// All effects.
        pub fn all<S: Scalar>() -> [&'static dyn Effect<S>; COUNT] {
            [$(&$module::$effect),*]
        }
    };
}

registry! {
    superelliptic_surface SuperellipticSurface
    exact_surface ExactSurface
    pressure_offset PressureOffset
    push_height PushHeight
    table_anisotropy TableAnisotropy
    object_anisotropy ObjectAnisotropy
    friction_gradient FrictionGradient
    speed_dependent_friction SpeedDependentFriction
    contact_friction_slip ContactFrictionSlip
    tip_offset TipOffset
    frame_registration FrameRegistration
    rod_compliance RodCompliance
    pose_offset PoseOffset
    pose_latency PoseLatency
    table_tilt TableTilt
    inertia Inertia
}

/// Position of a kind in [`all`].
pub fn index_of(kind: &str) -> Option<usize> {
    all::<f64>().iter().position(|e| e.spec().kind == kind)
}

/// The description of a kind, the scatter of friction included.
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
        .chain([SCATTER_KIND])
        .min_by_key(|known| crate::model::edit_distance(kind, known))
        .unwrap_or(SCATTER_KIND)
}
