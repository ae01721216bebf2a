//! The object has mass: it runs ahead of a fast rod and coasts.

use super::Effect;
use crate::Scalar;
use crate::effects::{EffectSpec, Location, Needs};
use crate::push::setting::Setting;

/// M d(twist)/dt = contact - friction
pub struct Inertia;

static SPEC: EffectSpec = EffectSpec {
    kind: "inertia",
    location: Location::Support,
    parameters: &[],
    needs: Needs::Nothing,
    stands_for: &[],
    excludes: &[],
    formula: "M d(twist)/dt = contact - friction",
    source: "Newton and Euler; Yu et al. 2016 (pushes up to 500 mm/s)",
};

impl<S: Scalar> Effect<S> for Inertia {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, _p: &[S], setting: &mut Setting<S>) {
        setting.inertia = Some(S::constant(1.0));
    }
}
