//! The four support surfaces of the MIT set.

use serde::Serialize;

/// Friction statistics of a support surface.
///
/// Friction and its spatial scatter are from Yu et al., IROS 2016, section V (means of new and used sheets).
/// Correlation length, contact friction and anisotropy ratio are chosen here, because the paper gives curves
/// and no numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SupportSheet {
    /// Name of the support surface.
    pub name: &'static str,
    /// Mean coefficient of friction between object and support.
    pub friction: f64,
    /// Standard deviation of the friction over the sheet, relative to the mean.
    pub friction_scatter: f64,
    /// Correlation length of the friction map, m.
    pub correlation_m: f64,
    /// Ratio of friction along the direction of anisotropy to friction across it; 1 for none.
    pub anisotropy_ratio: f64,
    /// Direction of the anisotropy, rad, in the frame of the table.
    pub anisotropy_angle_rad: f64,
    /// True friction between rod and object; the declared one is 0.25.
    pub contact_friction: f64,
}

/// All support surfaces of the MIT set.
pub const SUPPORTS: [SupportSheet; 4] = [
    SupportSheet {
        name: "abs",
        friction: 0.14,
        friction_scatter: 0.12,
        correlation_m: 0.03,
        anisotropy_ratio: 1.0,
        anisotropy_angle_rad: 0.0,
        contact_friction: 0.21,
    },
    SupportSheet {
        name: "delrin",
        friction: 0.14,
        friction_scatter: 0.11,
        correlation_m: 0.04,
        anisotropy_ratio: 1.0,
        anisotropy_angle_rad: 0.0,
        contact_friction: 0.23,
    },
    SupportSheet {
        name: "plywood",
        friction: 0.26,
        friction_scatter: 0.09,
        correlation_m: 0.03,
        anisotropy_ratio: 1.1,
        anisotropy_angle_rad: 0.3,
        contact_friction: 0.28,
    },
    SupportSheet {
        name: "pu",
        friction: 0.285,
        friction_scatter: 0.22,
        correlation_m: 0.03,
        anisotropy_ratio: 1.4,
        anisotropy_angle_rad: 0.9,
        contact_friction: 0.26,
    },
];

impl SupportSheet {
    /// The support surface of this name; `None` if there is none.
    pub fn named(name: &str) -> Option<Self> {
        SUPPORTS.into_iter().find(|s| s.name == name)
    }
}
