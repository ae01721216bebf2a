//! Friction between rod and object that depends on the slip speed.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};
use crate::push::setting::Setting;

/// Friction coefficient between rod and object `mu_c = mu_c0 (1 + k |slip|)` at the slip speed.
pub struct ContactFrictionSlip;

static SPEC: EffectSpec = EffectSpec {
    kind: "contact-friction-slip",
    location: Location::Contact,
    parameters: &[ParameterSpec {
        name: "k_s_per_m",
        unit: "s/m",
        min: -20.0,
        max: 200.0,
        typical: 20.0,
        null: 0.0,
    }],
    needs: Needs::Nothing,
    equivalent_causes: &[],
    excludes: &[],
    formula: "mu_c = mu_c0 (1 + k |slip|)",
    source: "Yu et al. 2016, IROS, section V (friction at several speeds)",
    separated_by: &[(
        Rival::Kind("speed-dependent-friction"),
        "push at 30 and 70 degrees and at two speeds: slip speed and sliding speed then differ",
    )],
    confirmed_by: Some(
        "measure the ratio of tangential to normal force while the rod slides: it is the friction coefficient",
    ),
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for ContactFrictionSlip {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, p: &[S], setting: &mut Setting<S>) {
        setting.slip_rise_s_per_m = Some(p[0]);
    }
}
