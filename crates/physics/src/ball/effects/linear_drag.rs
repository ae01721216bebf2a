//! Viscous drag, proportional to the velocity relative to the air.

use super::{Effect, Flight, Law};
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec};
use crate::scalar::axpy;

/// Viscous drag a = -c (v - w), w the velocity of the air.
pub struct LinearDrag;

static SPEC: EffectSpec = EffectSpec {
    kind: "linear-drag",
    location: Location::Flight,
    parameters: &[ParameterSpec {
        name: "c_per_s",
        unit: "1/s",
        min: 0.0,
        max: 20.0,
        typical: 0.05,
        null: 0.0,
    }],
    needs: Needs::Nothing,
    equivalent_causes: &[],
    excludes: &[],
    formula: "a = -c (v - w), w the velocity of the air",
    source: "Stokes 1851; also the linear damping of simulation engines",
    costly: true,
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for LinearDrag {
    fn changes_flight(&self) -> bool {
        true
    }
    fn acceleration(&self, p: &[S], flight: &Flight<'_, S>, a: &mut [S; 3]) {
        *a = axpy(a, &flight.airspeed, -p[0]);
    }
}

impl<S: Scalar> Effect<S> for LinearDrag {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
