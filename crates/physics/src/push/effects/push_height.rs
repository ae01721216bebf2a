//! Shift of the centre of pressure because the rod pushes above the support.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};
use crate::push::setting::Setting;

/// Shift of the centre of pressure by `z f / (m g)` along the force `f` of the rod at height `z`.
pub struct PushHeight;

static SPEC: EffectSpec = EffectSpec {
    kind: "push-height",
    location: Location::Support,
    parameters: &[ParameterSpec { name: "z_m", unit: "m", min: 0.0, max: 0.1, typical: 0.01, null: 0.0 }],
    needs: Needs::Nothing,
    equivalent_causes: &[],
    excludes: &[],
    formula: "centre of pressure moves by z f / (m g) along the force f of the rod",
    source: "Lynch 1999, ICRA (toppling); statics of the plate",
    separated_by: &[
        (
            Rival::Kind("exact-surface"),
            "move the rod to another height: the pressure under the leading edge changes in proportion",
        ),
        (
            Rival::Kind("superelliptic-surface"),
            "move the rod to another height: the pressure under the leading edge changes in proportion",
        ),
    ],
    costly: true,
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for PushHeight {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, p: &[S], setting: &mut Setting<S>) {
        setting.push_height_m = Some(p[0]);
    }
}
