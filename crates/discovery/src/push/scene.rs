//! What a view from above shows of a push beside the poses.

use serde::{Deserialize, Serialize};

/// The object and the rod.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PushScene {
    /// Corners of the object in its own frame, m.
    pub outline_m: Vec<[f64; 2]>,
    /// Centre of the rod at the times of the samples, m.
    pub rod_m: Vec<[f64; 2]>,
    /// Its radius, m.
    pub rod_radius_m: f64,
}
