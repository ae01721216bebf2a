//! Random variation of friction over the table, as a random effect per push.
//!
//! This is not an [`Effect`](super::Effect), because its parameter is the standard deviation of a random
//! draw. All that poses show of such a friction map is a centre of friction that differs between pushes.

use crate::library::{EffectSpec, Location, Needs, ParameterSpec};

/// Kind of effect by which model files name the scatter of friction.
pub const SCATTER_KIND: &str = "friction-scatter";

/// Description of the random variation of friction between pushes.
pub static SCATTER_SPEC: EffectSpec = EffectSpec {
    kind: SCATTER_KIND,
    location: Location::Support,
    parameters: &[ParameterSpec { name: "sd_m", unit: "m", min: 0.0, max: 0.02, typical: 0.001, null: 0.0 }],
    needs: Needs::Nothing,
    equivalent_causes: &["friction map per push", "dirt", "wear"],
    excludes: &[],
    formula: "centre of friction normal about the declared one with standard deviation sd, drawn per push",
    source: "Yu et al. 2016, IROS, section VII (2,000 equal pushes)",
    confirmed_by: Some(
        "repeat one push a hundred times, and in half of them wipe table and object without touching the marker: wiping removes scatter due to dirt, but not scatter due to the marker or the contact point",
    ),
    ..EffectSpec::DEFAULT
};
