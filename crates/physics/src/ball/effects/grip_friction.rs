//! Grip friction: each impact removes a fixed fraction of the slip velocity.

use super::{Effect, Law};
use crate::Scalar;
use crate::ball::impact::Impact;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec};
use crate::scalar::axpy;

/// Velocity change at the impact dv_t = -kappa u, u the slip; kappa = i / (1 + i) if the ball sticks.
pub struct GripFriction;

static SPEC: EffectSpec = EffectSpec {
    kind: "grip-friction",
    location: Location::Impact,
    parameters: &[ParameterSpec { name: "kappa", unit: "", min: 0.0, max: 1.0, typical: 0.05, null: 0.0 }],
    needs: Needs::Slip,
    equivalent_causes: &[],
    excludes: &["coulomb-friction"],
    formula: "dv_t = -kappa u, u the slip; kappa = i / (1 + i) when the ball sticks",
    source: "Cross 2002, Am. J. Phys. 70:1093 (grip)",
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for GripFriction {
    fn tangential(&self, p: &[S], impact: &Impact<'_, S>, j: &mut [S; 3]) {
        *j = axpy(j, &impact.slip, -p[0]);
    }
}

impl<S: Scalar> Effect<S> for GripFriction {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
