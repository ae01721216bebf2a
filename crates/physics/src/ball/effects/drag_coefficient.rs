//! Air drag with a common drag coefficient for balls of known size and mass.

use super::{Effect, Flight, Law};
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec};
use crate::scalar::{axpy, dot};

/// Density of air at 20 °C and 1013 hPa, kg/m³.
const AIR_KG_M3: f64 = 1.204;

/// Air drag a = -rho Cd A / (2 m) |v - w| (v - w), A and m recorded for each trajectory, w the wind.
pub struct DragCoefficient;

static SPEC: EffectSpec = EffectSpec {
    kind: "drag-coefficient",
    location: Location::Flight,
    parameters: &[ParameterSpec { name: "cd", unit: "", min: 0.0, max: 5.0, typical: 0.4, null: 0.0 }],
    needs: Needs::AreaPerMass,
    equivalent_causes: &[],
    excludes: &["quadratic-drag"],
    formula: "a = -rho Cd A / (2 m) |v - w| (v - w), rho = 1.204 kg/m³, A = pi R², R and m of each trajectory",
    source: "Nagurka 2003, Int. J. Engng Ed. 19:623",
    costly: true,
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for DragCoefficient {
    fn changes_flight(&self) -> bool {
        true
    }
    fn acceleration(&self, p: &[S], flight: &Flight<'_, S>, a: &mut [S; 3]) {
        let u = &flight.airspeed;
        let k = p[0] * (0.5 * AIR_KG_M3 * flight.covariates.area_per_mass_m2_kg);
        *a = axpy(a, u, -(k * dot(u, u).sqrt()));
    }
}

impl<S: Scalar> Effect<S> for DragCoefficient {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
