//! Restitution that falls linearly with the impact speed.

use crate::Scalar;
use crate::ball::Impact;
use crate::effects::{Effect, EffectSpec, Law, Location, Needs, ParameterSpec};

/// e = e0 - b (v_n - 3 m/s)
pub struct RestitutionSpeedLinear;

static SPEC: EffectSpec = EffectSpec {
    kind: "restitution-speed-linear",
    location: Location::Impact,
    parameters: &[ParameterSpec {
        name: "b_s_per_m",
        unit: "s/m",
        min: -0.3,
        max: 0.3,
        typical: 0.01,
        null: 0.0,
    }],
    needs: Needs::Nothing,
    stands_for: &[],
    excludes: &["restitution-speed-power"],
    formula: "e = e0 - b (v_n - 3 m/s)",
    source: "Cross 1999, Am. J. Phys. 67:222",
};

impl<S: Scalar> Law<S> for RestitutionSpeedLinear {
    fn restitution(&self, p: &[S], impact: &Impact<'_, S>, e: S) -> S {
        e - p[0] * (impact.normal_speed - 3.0)
    }
}

impl<S: Scalar> Effect<S> for RestitutionSpeedLinear {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
