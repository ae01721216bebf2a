//! Compliance of the rod and of the arm that holds it.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};
use crate::push::setting::Setting;

/// True rod position: the reported one minus `c F`, with `F` the force on the object.
pub struct RodCompliance;

static SPEC: EffectSpec = EffectSpec {
    kind: "rod-compliance",
    location: Location::Rod,
    parameters: &[ParameterSpec {
        name: "c_m_per_N",
        unit: "m/N",
        min: 0.0,
        max: 0.002,
        typical: 0.000125,
        null: 0.0,
    }],
    needs: Needs::Nothing,
    equivalent_causes: &[],
    excludes: &[],
    formula: "true rod = reported rod - c F, F the force on the object",
    source: "fit of the gap to the force in one published record",
    separated_by: &[(
        Rival::Kind("pose-latency"),
        "push at several speeds and record the stop: the effect of a delay grows with the speed and vanishes at rest, that of a deflection does not",
    )],
    costly: true,
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for RodCompliance {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, p: &[S], setting: &mut Setting<S>) {
        setting.compliance_m_per_n = Some(p[0]);
    }
}
