//! Constant offset of the reported rod position, from the calibration of robot against tracker.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};
use crate::push::setting::Setting;

/// True rod position: the reported one plus `(dx, dy)`, in the world frame.
pub struct TipOffset;

static SPEC: EffectSpec = EffectSpec {
    kind: "tip-offset",
    location: Location::Rod,
    parameters: &[
        ParameterSpec { name: "dx_m", unit: "m", min: -0.01, max: 0.01, typical: 0.0005, null: 0.0 },
        ParameterSpec { name: "dy_m", unit: "m", min: -0.01, max: 0.01, typical: 0.0005, null: 0.0 },
    ],
    needs: Needs::Nothing,
    equivalent_causes: &[],
    excludes: &["frame-registration"],
    formula: "true rod = reported rod + (dx, dy), in the world",
    source: "calibration of two frames",
    separated_by: &[(
        Rival::Kind("rod-compliance"),
        "push in several directions with and without load: an offset is fixed in the world, a deflection follows the force",
    )],
    confirmed_by: Some(
        "move the rod to marks all over the table and compare its positions with the tracker; no push is needed",
    ),
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for TipOffset {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, p: &[S], setting: &mut Setting<S>) {
        setting.tip_offset_m = Some([p[0], p[1]]);
    }
}
