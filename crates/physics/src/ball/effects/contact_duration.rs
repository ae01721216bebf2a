//! Finite contact duration: the ground is a damped spring, and gravity acts during contact.

use super::{Effect, Law};
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival, Start};

/// Spring contact while z < 0: z'' = -g - 2 l z' - w0^2 z, pi / sqrt(w0^2 - l^2) = tau, l tau = -ln e.
pub struct ContactDuration;

static SPEC: EffectSpec = EffectSpec {
    kind: "contact-duration",
    location: Location::Impact,
    parameters: &[ParameterSpec { name: "tau_s", unit: "s", min: 0.0, max: 0.2, typical: 0.003, null: 0.0 }],
    needs: Needs::Nothing,
    equivalent_causes: &[],
    excludes: &[],
    formula: "z'' = -g - 2 l z' - w0^2 z while z < 0; pi / sqrt(w0^2 - l^2) = tau, l tau = -ln e",
    source: "Cross 1999, Am. J. Phys. 67:222; Kelvin-Voigt contact",
    start: Start::Within(&[[1e-3, 0.05]]),
    separated_by: &[(
        Rival::Any,
        "also record the impacts with a microphone: the impact times determine delay and contact duration independently of the heights",
    )],
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for ContactDuration {
    fn contact_duration(&self, p: &[S]) -> Option<S> {
        Some(p[0])
    }
}

impl<S: Scalar> Effect<S> for ContactDuration {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
