//! Constant measurement delay, or a release that was not at time zero.

use super::{Effect, Law};
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};

/// Measurement z' that shows the true position `delay` earlier: z'(t) = z(t - delay).
pub struct Latency;

static SPEC: EffectSpec = EffectSpec {
    kind: "latency",
    location: Location::Sensor,
    parameters: &[ParameterSpec {
        name: "delay_s",
        unit: "s",
        min: -0.5,
        max: 0.5,
        typical: 0.004,
        null: 0.0,
    }],
    needs: Needs::ReleaseAtRest,
    equivalent_causes: &["late clock", "release before or after t = 0"],
    excludes: &[],
    formula: "z'(t) = z(t - delay)",
    source: "calibration of the instrument",
    separated_by: &[(
        Rival::Any,
        "also record the impacts with a microphone: the impact times determine delay and contact duration independently of the heights",
    )],
    confirmed_by: Some(
        "record the release itself with a second instrument (a light gate or a microphone): this distinguishes a late clock from a late release",
    ),
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Law<S> for Latency {
    fn delay(&self, p: &[S]) -> Option<S> {
        Some(p[0])
    }
}

impl<S: Scalar> Effect<S> for Latency {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
}
