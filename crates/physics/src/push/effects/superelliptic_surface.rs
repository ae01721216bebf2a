//! Superelliptic limit surface, with another exponent than the ellipsoid's 2.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec};
use crate::push::setting::{Friction, Setting};

/// Limit surface `|f|^p + |m/c|^p = 1` for force f and moment m.
pub struct SuperellipticSurface;

static SPEC: EffectSpec = EffectSpec {
    kind: "superelliptic-surface",
    location: Location::Support,
    parameters: &[ParameterSpec { name: "p", unit: "", min: 1.2, max: 6.0, typical: 1.7, null: 2.0 }],
    needs: Needs::Nothing,
    equivalent_causes: &["pressure concentration", "exact surface under uniform pressure"],
    excludes: &["exact-surface", "speed-dependent-friction"],
    formula: "|f|^p + |m/c|^p = 1",
    source: "Zhou, Paolini, Bagnell and Mason 2016, ICRA (shapes of limit surfaces)",
    confirmed_by: Some(
        "put a sheet of paper under the object, which evens out its pressure; then push at two contact offsets",
    ),
    costly: true,
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for SuperellipticSurface {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, p: &[S], setting: &mut Setting<S>) {
        setting.friction = Friction::Superellipsoid(p[0]);
    }
}
