//! A constant horizontal acceleration along x.

use crate::Scalar;
use crate::effects::{Effect, EffectSpec, Law, Location, Needs, ParameterSpec, Rival};

/// The law is a_x = a.
pub struct HorizontalAcceleration;

static SPEC: EffectSpec = EffectSpec {
    kind: "horizontal-acceleration",
    location: Location::Flight,
    parameters: &[ParameterSpec {
        name: "a_m_s2",
        unit: "m/s²",
        min: -9.0,
        max: 9.0,
        typical: 0.1,
        null: 0.0,
    }],
    needs: Needs::Horizontal,
    stands_for: &["steady side force", "apparatus out of level"],
    excludes: &[],
    formula: "a_x = a",
    source: "geometry: gravity times the tangent of the angle out of level",
    separated_by: &[(
        Rival::Any,
        "turn the camera by 90 degrees, then the ground by 180 degrees: camera, ground and force change sign separately",
    )],
    confirmed_by: Some(
        "turn the apparatus by 180 degrees about the vertical: a force of the room changes sign, an apparatus out of level does not",
    ),
    ..EffectSpec::PLAIN
};

impl<S: Scalar> Law<S> for HorizontalAcceleration {
    fn constant_acceleration(&self, p: &[S], a: &mut [S; 3]) {
        a[0] += p[0];
    }
}

impl<S: Scalar> Effect<S> for HorizontalAcceleration {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
