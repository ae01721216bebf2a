//! Per-trajectory correction of the spin, where it was not recorded or recorded wrongly.

use super::{Effect, Law};
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec};

/// True spin at the release: recorded spin (0 if not recorded) plus an offset.
pub struct SpinOffset;

/// Specification of one component of the spin offset as an effect parameter.
const fn rate(name: &'static str) -> ParameterSpec {
    ParameterSpec { name, unit: "rad/s", min: -3000.0, max: 3000.0, typical: 100.0, null: 0.0 }
}

static SPEC: EffectSpec = EffectSpec {
    kind: "spin-offset",
    location: Location::Sensor,
    parameters: &[rate("x_rad_s"), rate("y_rad_s"), rate("z_rad_s")],
    needs: Needs::PerTrajectory,
    formula: "spin = recorded spin + (x, y, z), of each trajectory",
    source: "the spin varies from throw to throw; Magnus lift and rebound reveal it",
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for SpinOffset {
    fn spin(&self, p: &[S], spin: &mut [S; 3]) {
        spin.iter_mut().zip(p).for_each(|(w, p)| *w += *p);
    }
}

impl<S: Scalar> Effect<S> for SpinOffset {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
