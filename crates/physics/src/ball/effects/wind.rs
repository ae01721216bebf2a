//! Steady horizontal wind along x, which acts through the drag.

use super::{Effect, Law};
use crate::Scalar;
use crate::library::{EffectSpec, Join, Location, Needs, ParameterSpec};

/// Air that moves with velocity w along x; drag acts on v - w, v the velocity of the ball.
pub struct Wind;

static SPEC: EffectSpec = EffectSpec {
    kind: "wind",
    location: Location::Flight,
    parameters: &[ParameterSpec {
        name: "w_m_s",
        unit: "m/s",
        min: -30.0,
        max: 30.0,
        typical: 1.0,
        null: 0.0,
    }],
    needs: Needs::Horizontal,
    equivalent_causes: &[],
    excludes: &[],
    formula: "the air moves with w along x; drag acts on v - w",
    source: "relative-velocity drag, e.g. Mehta 1985",
    joins: Some(Join { kind: "quadratic-drag", carrier_start: &[0.02], effect_starts: &[&[-2.0], &[2.0]] }),
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for Wind {
    fn air_velocity(&self, p: &[S], w: &mut [S; 3]) {
        w[0] += p[0];
    }
}

impl<S: Scalar> Effect<S> for Wind {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
