//! Random effect: restitution that varies between impacts or between trajectories.
//!
//! It is not a [`Law`](super::Law): its parameter is a standard deviation, and the engine takes the
//! realisations (the offsets `xi`) as inputs, because the likelihood is evaluated at given realisations.

use crate::library::{EffectSpec, Location, Needs, ParameterSpec};
use augsim_system::ScatterPer;

/// Kind of effect by which model files name the random scatter of the restitution.
pub const SCATTER_KIND: &str = "restitution-scatter";

/// Description of the random scatter of the restitution for discovery, model files and reports.
pub static SCATTER_SPEC: EffectSpec = EffectSpec {
    kind: SCATTER_KIND,
    location: Location::Impact,
    parameters: &[ParameterSpec { name: "sd", unit: "", min: 0.0, max: 0.5, typical: 0.02, null: 0.0 }],
    needs: Needs::Nothing,
    equivalent_causes: &[],
    excludes: &[],
    formula: "e = e0 + xi, xi normal with mean 0 and standard deviation sd, drawn per impact or per trajectory",
    source: "Montaine et al. 2011, arXiv:1104.0049 (roughness)",
    ..EffectSpec::DEFAULT
};

/// Word for the model-file key `per`: whether the restitution is drawn per impact or per trajectory.
pub fn scatter_word(per: ScatterPer) -> &'static str {
    match per {
        ScatterPer::Event => "impact",
        ScatterPer::Record => "trajectory",
    }
}
