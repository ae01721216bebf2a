//! The four supports of the MIT set.

use serde::Serialize;

/// A sheet on the table, with its statistics.
///
/// Friction and its spatial scatter: Yu et al., IROS 2016, section V (means of new and used sheets). Correlation length,
/// friction at the contact and the amount of anisotropy are ours: the paper gives curves, not numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SupportSheet {
    /// Its name.
    pub name: &'static str,
    /// Mean coefficient of friction.
    pub friction: f64,
    /// Standard deviation of the friction over the sheet, relative to the mean.
    pub friction_scatter: f64,
    /// Correlation length of the friction map, m.
    pub correlation_m: f64,
    /// Friction along a direction over friction across it.
    pub anisotropy_ratio: f64,
    /// Direction of the anisotropy, rad.
    pub anisotropy_angle_rad: f64,
    /// Friction between rod and object as it is; 0.25 is declared.
    pub contact_friction: f64,
}

/// The supports.
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
    /// The support of that name.
    pub fn named(name: &str) -> Option<Self> {
        SUPPORTS.into_iter().find(|s| s.name == name)
    }
}
