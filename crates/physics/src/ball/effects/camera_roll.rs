//! Camera roll: a camera rotated about its optical axis.

use super::{Effect, Law, Measurement};
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};

/// Camera rotated by phi about its axis: x' = x cos(phi) - z sin(phi), z' = x sin(phi) + z cos(phi).
pub struct CameraRoll;

static SPEC: EffectSpec = EffectSpec {
    kind: "camera-roll",
    location: Location::Sensor,
    parameters: &[ParameterSpec {
        name: "phi_rad",
        unit: "rad",
        min: -0.5,
        max: 0.5,
        typical: 0.005,
        null: 0.0,
    }],
    needs: Needs::Horizontal,
    equivalent_causes: &[],
    excludes: &[],
    formula: "x' = x cos(phi) - z sin(phi), z' = x sin(phi) + z cos(phi)",
    source: "geometry of projection",
    separated_by: &[(
        Rival::Any,
        "rotate the camera by 90 degrees, then the ground by 180 degrees: the effects of camera, ground and force change sign independently",
    )],
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for CameraRoll {
    fn changes_measurement(&self) -> bool {
        true
    }
    fn observe(&self, p: &[S], sight: &mut Measurement<S>) {
        let (sin, cos) = (p[0].sin(), p[0].cos());
        let [x, y, z] = sight.position;
        sight.position = [x * cos - z * sin, y, x * sin + z * cos];
    }
}

impl<S: Scalar> Effect<S> for CameraRoll {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
