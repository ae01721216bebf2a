//! Constant vertical acceleration in addition to the declared gravity.

use super::{Effect, Law};
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec};

/// Constant vertical acceleration a of the ball in addition to gravity: a_z = a.
pub struct VerticalAcceleration;

static SPEC: EffectSpec = EffectSpec {
    kind: "vertical-acceleration",
    location: Location::Flight,
    parameters: &[ParameterSpec {
        name: "a_m_s2",
        unit: "m/s²",
        min: -9.0,
        max: 9.0,
        typical: 0.1,
        null: 0.0,
    }],
    needs: Needs::Nothing,
    equivalent_causes: &[
        "wrong gravity",
        "buoyancy or added mass",
        "steady updraught",
        "clock rate error",
        "length scale error",
    ],
    excludes: &[],
    formula: "a_z = a",
    source: "Pantaleone and Messer 2011, Am. J. Phys. (buoyancy and added mass)",
    confirmed_by: Some(
        "measure a known time and a known length in view (a blinking LED, a ruler), and drop a heavy and a light ball of equal size: buoyancy changes with the mass, clock and scale do not",
    ),
    same_as: Some("gravity_m_s2"),
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for VerticalAcceleration {
    fn constant_acceleration(&self, p: &[S], a: &mut [S; 3]) {
        a[2] += p[0];
    }
}

impl<S: Scalar> Effect<S> for VerticalAcceleration {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
