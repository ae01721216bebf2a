//! Restitution that drifts linearly with session time, e.g. by wear, warming or deflation.

use super::{Effect, Law};
use crate::Scalar;
use crate::ball::impact::Impact;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};

/// Restitution e = e0 + d (T - T_ref), T the session time of the impact, T_ref the reference time.
pub struct RestitutionDrift;

static SPEC: EffectSpec = EffectSpec {
    kind: "restitution-drift",
    location: Location::Impact,
    parameters: &[ParameterSpec {
        name: "d_per_s",
        unit: "1/s",
        min: -0.1,
        max: 0.1,
        typical: 0.0001,
        null: 0.0,
    }],
    needs: Needs::StartTime,
    equivalent_causes: &[],
    excludes: &[],
    formula: "e = e0 + d (T - T_ref), T the session time of the impact",
    source: "measurements on squash and tennis balls: restitution versus temperature",
    separated_by: &[(Rival::Any, "repeat the same throw at marked places, in random order over the session")],
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for RestitutionDrift {
    fn restitution(&self, p: &[S], impact: &Impact<'_, S>, e: S) -> S {
        e + p[0] * impact.clock()
    }
}

impl<S: Scalar> Effect<S> for RestitutionDrift {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
