//! Offset of the centre of pressure, and of the centre of mass, from the centroid.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};
use crate::push::setting::Setting;

/// Centre of friction that is the point `(dx, dy)` of the body instead of the centroid.
pub struct PressureOffset;

static SPEC: EffectSpec = EffectSpec {
    kind: "pressure-offset",
    location: Location::Support,
    parameters: &[
        ParameterSpec { name: "dx_m", unit: "m", min: -0.03, max: 0.03, typical: 0.003, null: 0.0 },
        ParameterSpec { name: "dy_m", unit: "m", min: -0.03, max: 0.03, typical: 0.003, null: 0.0 },
    ],
    needs: Needs::Nothing,
    equivalent_causes: &["centre of mass off the centroid", "tracked origin off the centroid"],
    excludes: &[],
    formula: "friction acts about the body point (dx, dy)",
    source: "Yu et al. 2016, IROS (table III: frames)",
    separated_by: &[
        (
            Rival::Kind("friction-gradient"),
            "push from several start orientations and places: a centre of pressure turns with the object, a gradient does not",
        ),
        (
            Rival::Kind("table-tilt"),
            "push from several start orientations, then on a surface with another friction: the effect of tilt is proportional to 1/friction",
        ),
        (
            Rival::Kind("pose-offset"),
            "turn the object on the spot without the rod: its tracked position moves on a circle only if the tracked frame is offset",
        ),
    ],
    confirmed_by: Some("turn the object by 90 degrees under the same push: the deviation turns with it"),
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for PressureOffset {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, p: &[S], setting: &mut Setting<S>) {
        setting.pressure_offset_m = Some([p[0], p[1]]);
    }
}
