//! Constant horizontal acceleration along x.

use super::{Effect, Law};
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};

/// Constant acceleration a of the ball along x: a_x = a.
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
    equivalent_causes: &["steady side force", "tilted apparatus"],
    excludes: &[],
    formula: "a_x = a",
    source: "geometry: gravity times the tangent of the tilt angle",
    separated_by: &[(
        Rival::Any,
        "rotate the camera by 90 degrees, then the ground by 180 degrees: the effects of camera, ground and force change sign independently",
    )],
    confirmed_by: Some(
        "rotate the apparatus by 180 degrees about the vertical: relative to the apparatus an external force changes sign, a tilt of the apparatus does not",
    ),
    ..EffectSpec::DEFAULT
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
