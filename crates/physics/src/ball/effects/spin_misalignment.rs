//! Misaligned spin sensor: its axes are rotated against those of the positions.

use super::{Effect, Law};
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec};

/// The true spin is the recorded one rotated by alpha about x, then beta about y, then gamma about z.
pub struct SpinMisalignment;

/// Specification of a rotation angle of the spin sensor as an effect parameter.
const fn angle(name: &'static str) -> ParameterSpec {
    ParameterSpec { name, unit: "rad", min: -3.2, max: 3.2, typical: 0.1, null: 0.0 }
}

static SPEC: EffectSpec = EffectSpec {
    kind: "spin-misalignment",
    location: Location::Sensor,
    parameters: &[angle("alpha_rad"), angle("beta_rad"), angle("gamma_rad")],
    needs: Needs::SpinInSpace,
    equivalent_causes: &[],
    excludes: &[],
    formula: "spin = Rz(gamma) Ry(beta) Rx(alpha) recorded spin",
    source: "rotation matrix; the sensor that measures spin has its own axes",
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for SpinMisalignment {
    fn spin(&self, p: &[S], spin: &mut [S; 3]) {
        for (axis, &angle) in p.iter().enumerate().take(3) {
            let (sin, cos) = (angle.sin(), angle.cos());
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            (spin[i], spin[j]) = (spin[i] * cos - spin[j] * sin, spin[i] * sin + spin[j] * cos);
        }
    }
}

impl<S: Scalar> Effect<S> for SpinMisalignment {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
