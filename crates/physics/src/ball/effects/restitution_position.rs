//! Restitution that depends linearly on the landing position along x.

use super::{Effect, Law};
use crate::Scalar;
use crate::ball::impact::Impact;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};

/// Restitution e = e0 + q x at the landing position x.
pub struct RestitutionPosition;

static SPEC: EffectSpec = EffectSpec {
    kind: "restitution-position",
    location: Location::Impact,
    parameters: &[ParameterSpec {
        name: "q_per_m",
        unit: "1/m",
        min: -1.0,
        max: 1.0,
        typical: 0.02,
        null: 0.0,
    }],
    needs: Needs::Horizontal,
    equivalent_causes: &[],
    excludes: &[],
    formula: "e = e0 + q x",
    source: "a floor with non-uniform properties",
    separated_by: &[(Rival::Any, "repeat the same throw at marked places, in random order over the session")],
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for RestitutionPosition {
    fn restitution(&self, p: &[S], impact: &Impact<'_, S>, e: S) -> S {
        e + p[0] * impact.position[0]
    }
}

impl<S: Scalar> Effect<S> for RestitutionPosition {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
