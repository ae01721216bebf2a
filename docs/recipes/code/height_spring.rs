//! A weak spring between the ball and a height.

use crate::Scalar;
use crate::ball::effects::{Effect, Flight, Law};
use crate::library::{EffectSpec, Location, ParameterSpec};

/// The law is a_z = f - k z.
pub struct HeightSpring;

static SPEC: EffectSpec = EffectSpec {
    kind: "height-spring",
    location: Location::Flight,
    parameters: &[
        ParameterSpec { name: "k_per_s2", unit: "1/s²", min: -50.0, max: 50.0, typical: 0.5, null: 0.0 },
        ParameterSpec { name: "f_m_s2", unit: "m/s²", min: -50.0, max: 50.0, typical: 0.5, null: 0.0 },
    ],
    equivalent_causes: &["an elastic tether", "a fan below"],
    formula: "a_z = f - k z",
    source: "Hooke 1678",
    costly: true,
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for HeightSpring {
    fn changes_flight(&self) -> bool {
        true
    }
    fn acceleration(&self, p: &[S], flight: &Flight<'_, S>, a: &mut [S; 3]) {
        a[2] = a[2] + p[1] - p[0] * flight.position[2];
    }
}

impl<S: Scalar> Effect<S> for HeightSpring {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
