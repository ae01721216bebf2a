//! Limit surface of Coulomb friction integrated over a uniformly pressed footprint.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, Rival};
use crate::push::setting::{Friction, Setting};

/// Limit surface of a uniformly pressed footprint, with dissipation `D = <|v + w x rho|>` (area mean).
pub struct ExactSurface;

static SPEC: EffectSpec = EffectSpec {
    kind: "exact-surface",
    location: Location::Support,
    parameters: &[],
    needs: Needs::Nothing,
    equivalent_causes: &["superelliptic surface"],
    excludes: &["superelliptic-surface", "speed-dependent-friction"],
    formula: "D = <|v + w x rho|> over the footprint",
    source: "Goyal, Ruina and Papadopoulos 1991, Wear 143:307",
    separated_by: &[(
        Rival::Kind("superelliptic-surface"),
        "push at two contact offsets (10 and 35 mm from the middle) at the same angle: the ratio of the turning rates at the two offsets differs",
    )],
    confirmed_by: Some(
        "put a sheet of paper under the object, which evens out its pressure; then push at two contact offsets",
    ),
    indicated_by: Some("superelliptic-surface"),
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for ExactSurface {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, _p: &[S], setting: &mut Setting<S>) {
        setting.friction = Friction::Uniform;
    }
}
