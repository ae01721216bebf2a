//! Error of the registration of the robot's frame to the tracker's: scale, rotation and offset.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};
use crate::push::setting::{Registration, Setting};

/// True rod position: `(1 + scale) R(angle)` times the reported one, plus `(dx, dy)`.
///
/// Both are in the world frame.
pub struct FrameRegistration;

static SPEC: EffectSpec = EffectSpec {
    kind: "frame-registration",
    location: Location::Rod,
    parameters: &[
        ParameterSpec { name: "scale", unit: "", min: -0.05, max: 0.05, typical: 0.005, null: 0.0 },
        ParameterSpec { name: "angle_rad", unit: "rad", min: -0.1, max: 0.1, typical: 0.01, null: 0.0 },
        ParameterSpec { name: "dx_m", unit: "m", min: -0.05, max: 0.05, typical: 0.0005, null: 0.0 },
        ParameterSpec { name: "dy_m", unit: "m", min: -0.05, max: 0.05, typical: 0.0005, null: 0.0 },
    ],
    needs: Needs::Nothing,
    equivalent_causes: &["scale or turn of the tracker's frame", "scale of the robot's frame"],
    excludes: &["tip-offset"],
    formula: "true rod = (1 + scale) R(angle) reported rod + (dx, dy), in the world",
    source: "similarity between two point sets (Umeyama 1991, IEEE PAMI 13); calibration of two frames",
    reduces_to: Some("tip-offset"),
    separated_by: &[
        (
            Rival::Kind("pose-latency"),
            "follow the same path at two speeds: a frame error depends on the position only, the effect of a delay grows with the speed",
        ),
        (
            Rival::Kind("pose-offset"),
            "push at places far from each other: an error of scale grows with the distance, an offset of the tracked frame does not",
        ),
    ],
    confirmed_by: Some(
        "move the rod to marks all over the table and compare its positions with the tracker; no push is needed",
    ),
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for FrameRegistration {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, p: &[S], setting: &mut Setting<S>) {
        setting.registration = Some(Registration::new(p[0], p[1], [p[2], p[3]]));
    }
}
