//! Constant horizontal acceleration along y (3-D data).

use super::{Effect, Law};
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec};

/// Constant acceleration a of the ball along y: a_y = a.
pub struct LateralAcceleration;

static SPEC: EffectSpec = EffectSpec {
    kind: "lateral-acceleration",
    location: Location::Flight,
    parameters: &[ParameterSpec {
        name: "a_m_s2",
        unit: "m/s²",
        min: -9.0,
        max: 9.0,
        typical: 0.1,
        null: 0.0,
    }],
    needs: Needs::Lateral,
    equivalent_causes: &["steady side force", "tilted apparatus"],
    excludes: &[],
    formula: "a_y = a",
    source: "geometry: gravity times the tangent of the tilt angle",
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for LateralAcceleration {
    fn constant_acceleration(&self, p: &[S], a: &mut [S; 3]) {
        a[1] += p[0];
    }
}

impl<S: Scalar> Effect<S> for LateralAcceleration {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
