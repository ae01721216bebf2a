//! Coulomb friction at the impact: sliding, limited by sticking.

use super::{Effect, Law};
use crate::Scalar;
use crate::ball::impact::Impact;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival, Start};
use crate::scalar::{axpy, dot};

/// Friction impulse dv_t = -min(mu (1 + e) v_n, |u| i / (1 + i)) u / |u|, u the slip, i the inertia ratio.
pub struct CoulombFriction;

static SPEC: EffectSpec = EffectSpec {
    kind: "coulomb-friction",
    location: Location::Impact,
    parameters: &[ParameterSpec { name: "mu", unit: "", min: 0.0, max: 3.0, typical: 0.05, null: 0.0 }],
    needs: Needs::Slip,
    equivalent_causes: &[],
    excludes: &["grip-friction"],
    formula: "dv_t = -min(mu (1 + e) v_n, |u| i / (1 + i)) u / |u|, u the slip, i the inertia ratio",
    source: "Garwin 1969, Am. J. Phys. 37:88; Cross 2002, Am. J. Phys. 70:1093",
    start: Start::At(&[0.05]),
    separated_by: &[(
        Rival::Kind("grip-friction"),
        "throw with fast spin at a shallow angle: grip removes a fixed fraction of the slip, sliding friction a fixed amount",
    )],
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for CoulombFriction {
    fn tangential(&self, p: &[S], impact: &Impact<'_, S>, j: &mut [S; 3]) {
        let slip = dot(&impact.slip, &impact.slip).sqrt();
        let stick = impact.inertia_ratio / (impact.inertia_ratio + 1.0);
        let slide = p[0] * (impact.restitution + 1.0) * impact.normal_speed;
        // Below 1 nm/s the direction of the slip is dominated by rounding: the ball is taken to stick.
        let fraction =
            if slip.value() < 1e-9 || slide.value() >= (slip * stick).value() { stick } else { slide / slip };
        *j = axpy(j, &impact.slip, -fraction);
    }
}

impl<S: Scalar> Effect<S> for CoulombFriction {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
