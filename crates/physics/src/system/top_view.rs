//! A view from above of a motion in the plane.

use serde::{Deserialize, Serialize};

/// An object and what moves it, beside the object's poses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TopView {
    /// Corners of the object in its own frame, m.
    pub outline_m: Vec<[f64; 2]>,
    /// Centre of the rod at the times of the samples, m.
    pub rod_m: Vec<[f64; 2]>,
    /// Radius of the rod, m.
    pub rod_radius_m: f64,
}
