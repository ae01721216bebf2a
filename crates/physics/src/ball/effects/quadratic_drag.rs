//! Air drag at high Reynolds number, proportional to the square of the airspeed.

use super::{Effect, Flight, Law};
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};
use crate::scalar::{axpy, dot};

/// Air drag a = -k |v - w| (v - w), w the velocity of the air.
pub struct QuadraticDrag;

static SPEC: EffectSpec = EffectSpec {
    kind: "quadratic-drag",
    location: Location::Flight,
    parameters: &[ParameterSpec {
        name: "k_per_m",
        unit: "1/m",
        min: 0.0,
        max: 5.0,
        typical: 0.02,
        null: 0.0,
    }],
    needs: Needs::Nothing,
    equivalent_causes: &[],
    excludes: &["drag-coefficient"],
    formula: "a = -k |v - w| (v - w), w the velocity of the air",
    source: "Nagurka 2003, Int. J. Engng Ed. 19:623; k = rho Cd A / (2 m)",
    costly: true,
    separated_by: &[(
        Rival::Kind("linear-drag"),
        "drop from 0.3 m and from 5 m: the two drags differ most over a wide range of speeds",
    )],
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for QuadraticDrag {
    fn changes_flight(&self) -> bool {
        true
    }
    fn acceleration(&self, p: &[S], flight: &Flight<'_, S>, a: &mut [S; 3]) {
        let u = &flight.airspeed;
        *a = axpy(a, u, -(p[0] * dot(u, u).sqrt()));
    }
}

impl<S: Scalar> Effect<S> for QuadraticDrag {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
