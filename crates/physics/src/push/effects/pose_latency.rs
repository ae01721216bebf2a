//! Delay of the reported pose.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec};
use crate::push::setting::Setting;

/// Delay of the pose sensor: the pose reported at t is the true pose at t - delay.
pub struct PoseLatency;

static SPEC: EffectSpec = EffectSpec {
    kind: "pose-latency",
    location: Location::Sensor,
    parameters: &[ParameterSpec {
        name: "delay_s",
        unit: "s",
        min: -0.1,
        max: 0.2,
        typical: 0.02,
        null: 0.0,
    }],
    needs: Needs::Nothing,
    equivalent_causes: &[],
    excludes: &[],
    formula: "reported pose at t = pose at t - delay",
    source: "clocks of two instruments",
    confirmed_by: Some(
        "repeat the same contact at 10, 50 and 200 mm/s: quasi-static motion is the same at every speed",
    ),
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for PoseLatency {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, p: &[S], setting: &mut Setting<S>) {
        setting.delay_s = Some(p[0]);
    }
}
