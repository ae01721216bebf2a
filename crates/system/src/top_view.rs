//! Data for drawing a planar motion from above.

use serde::{Deserialize, Serialize};

/// Outline of a pushed object, and the path and radius of the rod; the object's poses are not included.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TopView {
    /// Corners of the object in its body frame, m.
    pub outline_m: Vec<[f64; 2]>,
    /// Centre of the rod at each sample time, m.
    pub rod_m: Vec<[f64; 2]>,
    /// Radius of the rod, m.
    pub rod_radius_m: f64,
}
