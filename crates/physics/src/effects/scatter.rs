//! Restitution that differs at random from impact to impact, or from trajectory to trajectory.
//!
//! Not a [`Law`](super::Law): its parameter is the standard deviation of a random number that the engine takes as an input
//! (the offsets `xi`), because a likelihood needs the numbers themselves.

use super::{EffectSpec, Location, Needs, ParameterSpec};
use crate::system::ScatterPer;

/// Kind of the scatter of restitution.
pub const SCATTER_KIND: &str = "restitution-scatter";

/// Description of the scatter of restitution.
pub static SCATTER_SPEC: EffectSpec = EffectSpec {
    kind: SCATTER_KIND,
    location: Location::Impact,
    parameters: &[ParameterSpec { name: "sd", unit: "", min: 0.0, max: 0.5, typical: 0.02, null: 0.0 }],
    needs: Needs::Nothing,
    stands_for: &[],
    excludes: &[],
    formula: "e = e0 + xi, xi normal with mean 0 and standard deviation sd, drawn per impact or per trajectory",
    source: "Montaine et al. 2011, arXiv:1104.0049 (roughness)",
    ..EffectSpec::PLAIN
};

/// The word in model files for what one draw of the restitution belongs to: `per = "impact"`.
pub fn scatter_word(per: ScatterPer) -> &'static str {
    match per {
        ScatterPer::Event => "impact",
        ScatterPer::Record => "trajectory",
    }
}
