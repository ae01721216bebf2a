//! Friction of the support that depends on the sliding speed (Stribeck).

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec};
use crate::push::setting::Setting;
use crate::push::surface::patches::SpeedLaw;

/// Friction `mu = mu0 (1 + a exp(-(v/v0)^2))` at the sliding speed v, integrated over the footprint.
pub struct SpeedDependentFriction;

static SPEC: EffectSpec = EffectSpec {
    kind: "speed-dependent-friction",
    location: Location::Support,
    parameters: &[
        ParameterSpec { name: "a", unit: "", min: -0.9, max: 2.0, typical: 0.25, null: 0.0 },
        ParameterSpec { name: "v0_m_s", unit: "m/s", min: 0.001, max: 0.5, typical: 0.01, null: 0.01 },
    ],
    needs: Needs::Nothing,
    equivalent_causes: &["viscous friction"],
    excludes: &["superelliptic-surface", "exact-surface"],
    formula: "mu = mu0 (1 + a exp(-(v/v0)^2)), integrated over the footprint",
    source: "Stribeck 1902; Armstrong-Helouvry 1991",
    first_simulated_at: &[0.1, 0.02],
    amplitude_count: Some(1),
    confirmed_by: Some(
        "repeat the same contact at 10, 50 and 200 mm/s: quasi-static motion is the same at every speed",
    ),
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for SpeedDependentFriction {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, p: &[S], setting: &mut Setting<S>) {
        setting.speed = Some(SpeedLaw { rise: p[0], speed_m_s: p[1] });
    }
}
