//! Inertia of the object: it moves ahead of a fast rod and coasts after it stops.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, Rival};
use crate::push::setting::Setting;

/// Inertia of the object: `M d(twist)/dt = contact - friction`, with the wrenches of rod and support.
pub struct Inertia;

static SPEC: EffectSpec = EffectSpec {
    kind: "inertia",
    location: Location::Support,
    parameters: &[],
    needs: Needs::Coasting,
    equivalent_causes: &[],
    excludes: &[],
    formula: "M d(twist)/dt = contact - friction",
    source: "Newton and Euler; Yu et al. 2016 (pushes up to 500 mm/s)",
    separated_by: &[(
        Rival::Kind("pose-latency"),
        "record the stop and push at several speeds: an object with inertia moves ahead of the rod and continues after the stop, a delayed sensor lags",
    )],
    confirmed_by: Some(
        "repeat the same contact at 10, 50 and 200 mm/s: quasi-static motion is the same at every speed",
    ),
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for Inertia {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, _p: &[S], setting: &mut Setting<S>) {
        setting.inertia = Some(S::constant(1.0));
    }
}
