//! Restitution that decreases linearly with the impact speed.

use super::{Effect, Law};
use crate::Scalar;
use crate::ball::impact::Impact;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};

/// Restitution e = e0 - b (v_n - 3 m/s) at the impact speed v_n.
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
    equivalent_causes: &[],
    excludes: &["restitution-speed-power"],
    formula: "e = e0 - b (v_n - 3 m/s)",
    source: "Cross 1999, Am. J. Phys. 67:222",
    separated_by: &[
        (
            Rival::Kind("restitution-speed-power"),
            "drop from very low (1 to 5 cm) and very high (5 m): a linear law and a power law differ most at the ends of the speed range",
        ),
        (
            Rival::At(Location::Flight),
            "record flights without a bounce (catch the ball): residuals there are not caused by restitution",
        ),
    ],
    ..EffectSpec::DEFAULT
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
