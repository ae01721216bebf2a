//! Constant offset of the measured height.

use super::{Effect, Law, Measurement};
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};

/// Measured height z' with a constant offset b from the true height z: z' = z + b.
pub struct HeightOffset;

static SPEC: EffectSpec = EffectSpec {
    kind: "height-offset",
    location: Location::Sensor,
    parameters: &[ParameterSpec { name: "b_m", unit: "m", min: -0.5, max: 0.5, typical: 0.003, null: 0.0 }],
    needs: Needs::Nothing,
    equivalent_causes: &[],
    excludes: &[],
    formula: "z' = z + b",
    source: "calibration of the instrument",
    same_as: Some("floor_height_m"),
    separated_by: &[(
        Rival::Any,
        "also record the impacts with a microphone: the impact times determine delay and contact duration independently of the heights",
    )],
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for HeightOffset {
    fn changes_measurement(&self) -> bool {
        true
    }
    fn observe(&self, p: &[S], sight: &mut Measurement<S>) {
        sight.position[2] += p[0];
    }
}

impl<S: Scalar> Effect<S> for HeightOffset {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
