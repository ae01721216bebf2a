//! Anisotropic friction fixed to the object.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec};
use crate::push::setting::{Anisotropy, Setting};
use augsim_system::Polar;

/// Friction with dissipation `D = |A^(1/2) v|`, `A = R diag(ratio, 1/ratio) R'`, fixed to the object.
///
/// `R` is the rotation by `angle` in the body frame.
pub struct ObjectAnisotropy;

static SPEC: EffectSpec = EffectSpec {
    kind: "object-anisotropy",
    location: Location::Support,
    parameters: &[
        ParameterSpec { name: "ratio", unit: "", min: 0.3, max: 3.0, typical: 1.2, null: 1.0 },
        ParameterSpec { name: "angle_rad", unit: "rad", min: -1.6, max: 1.6, typical: 0.0, null: 0.0 },
    ],
    needs: Needs::Nothing,
    equivalent_causes: &["ellipsoid with unequal force axes"],
    excludes: &[],
    formula: "D = |A^(1/2) v|, A = R diag(ratio, 1/ratio) R', R by angle in the body",
    source: "Goyal 1989, thesis, Cornell",
    first_simulated_at: &[1.02, 0.0],
    amplitude_count: Some(1),
    polar: Some(Polar::Axis),
    confirmed_by: Some("turn the object by 90 degrees under the same push: the deviation turns with it"),
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for ObjectAnisotropy {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, p: &[S], setting: &mut Setting<S>) {
        setting.object_anisotropy = Some(Anisotropy { ratio: p[0], angle_rad: p[1] });
    }
}
