//! Constant offset of the tracked frame in the body.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec};
use crate::push::setting::Setting;

/// Reported pose: the true one moved by `(dx, dy)` in the body frame and rotated by `dtheta`.
pub struct PoseOffset;

static SPEC: EffectSpec = EffectSpec {
    kind: "pose-offset",
    location: Location::Sensor,
    parameters: &[
        ParameterSpec { name: "dx_m", unit: "m", min: -0.02, max: 0.02, typical: 0.001, null: 0.0 },
        ParameterSpec { name: "dy_m", unit: "m", min: -0.02, max: 0.02, typical: 0.001, null: 0.0 },
        ParameterSpec { name: "dtheta_rad", unit: "rad", min: -0.2, max: 0.2, typical: 0.01, null: 0.0 },
    ],
    needs: Needs::Nothing,
    equivalent_causes: &[],
    excludes: &[],
    formula: "reported pose = true pose, then (dx, dy) in the body and a turn by dtheta",
    source: "calibration of markers",
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for PoseOffset {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, p: &[S], setting: &mut Setting<S>) {
        setting.pose_offset = Some(([p[0], p[1]], p[2]));
    }
}
