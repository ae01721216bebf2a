//! Ground tilted along x.

use super::{Effect, Law};
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};

/// Ground plane tilted by alpha along x: z = x tan(alpha).
pub struct GroundTilt;

static SPEC: EffectSpec = EffectSpec {
    kind: "ground-tilt",
    location: Location::Impact,
    parameters: &[ParameterSpec {
        name: "alpha_rad",
        unit: "rad",
        min: -0.5,
        max: 0.5,
        typical: 0.01,
        null: 0.0,
    }],
    needs: Needs::Horizontal,
    equivalent_causes: &[],
    excludes: &[],
    formula: "ground plane z = x tan(alpha)",
    source: "geometry",
    separated_by: &[(
        Rival::Any,
        "rotate the camera by 90 degrees, then the ground by 180 degrees: the effects of camera, ground and force change sign independently",
    )],
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for GroundTilt {
    fn ground_angle(&self, p: &[S]) -> Option<S> {
        Some(p[0])
    }
}

impl<S: Scalar> Effect<S> for GroundTilt {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
