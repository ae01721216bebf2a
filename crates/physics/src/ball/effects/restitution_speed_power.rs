//! Restitution that decreases as a power of the impact speed.

use super::{Effect, Law};
use crate::Scalar;
use crate::ball::impact::Impact;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};

/// Restitution e = e0 (v_n / 3 m/s)^-p at the impact speed v_n.
pub struct RestitutionSpeedPower;

static SPEC: EffectSpec = EffectSpec {
    kind: "restitution-speed-power",
    location: Location::Impact,
    parameters: &[ParameterSpec { name: "p", unit: "", min: -1.0, max: 1.0, typical: 0.05, null: 0.0 }],
    needs: Needs::Nothing,
    equivalent_causes: &[],
    excludes: &["restitution-speed-linear"],
    formula: "e = e0 (v_n / 3 m/s)^-p",
    source: "Johnson 1985, Contact Mechanics (plastic: p = 1/4); Thornton and Ning 1998",
    separated_by: &[(
        Rival::At(Location::Flight),
        "record flights without a bounce (catch the ball): residuals there are not caused by restitution",
    )],
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for RestitutionSpeedPower {
    fn restitution(&self, p: &[S], impact: &Impact<'_, S>, e: S) -> S {
        e * (-(p[0] * (impact.normal_speed * (1.0 / 3.0)).ln())).exp()
    }
}

impl<S: Scalar> Effect<S> for RestitutionSpeedPower {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
