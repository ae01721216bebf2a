//! Magnus force: lift on a spinning ball.

use super::{Effect, Flight, Law};
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec};
use crate::scalar::{axpy, cross};

/// Lift of a spinning ball: a = s (spin x v); in the plane, with spin w, a = s w (v_z, -v_x).
pub struct Magnus;

static SPEC: EffectSpec = EffectSpec {
    kind: "magnus",
    location: Location::Flight,
    parameters: &[ParameterSpec { name: "s", unit: "", min: -1.0, max: 1.0, typical: 0.005, null: 0.0 }],
    needs: Needs::Spin,
    equivalent_causes: &[],
    excludes: &[],
    formula: "a = s (spin x v); in the plane a = s w (v_z, -v_x)",
    source: "Mehta 1985, Annu. Rev. Fluid Mech. 17:151",
    costly: true,
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for Magnus {
    fn changes_flight(&self) -> bool {
        true
    }
    fn acceleration(&self, p: &[S], flight: &Flight<'_, S>, a: &mut [S; 3]) {
        *a = axpy(a, &cross(&flight.spin, &flight.velocity), p[0]);
    }
}

impl<S: Scalar> Effect<S> for Magnus {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
