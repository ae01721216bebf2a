//! Covariates of a throw: session time at the start, spin, size and mass.

use super::Covariates;
use augsim_system::{Quantity, Record};
use std::f64::consts::PI;

/// Name and unit of each covariate, in the order of the covariate vector.
const COVARIATES: [(&str, &str); 6] = [
    ("clock", "s"),
    ("spin_x", "rad/s"),
    ("spin_y", "rad/s"),
    ("spin_z", "rad/s"),
    ("area_per_mass", "m²/kg"),
    ("radius", "m"),
];
/// Index of the session time at the start among the covariates.
pub(super) const CLOCK: usize = 0;
/// Index of the cross-section area per mass among the covariates.
const AREA_PER_MASS: usize = 4;
/// Index of the ball's radius among the covariates.
const RADIUS: usize = 5;

/// Names and units of the covariates as schema entries.
pub(super) fn quantities() -> Vec<Quantity> {
    COVARIATES.iter().map(|(name, unit)| Quantity::new(name, unit)).collect()
}

/// Covariates of a trajectory, from its constant columns; NaN where not recorded.
pub(super) fn from_columns(constant: &dyn Fn(&str) -> Option<f64>) -> Vec<f64> {
    let radius = constant("radius_m");
    let area_per_mass = match (radius, constant("mass_kg")) {
        (Some(r), Some(m)) if m > 0.0 => Some(PI * r * r / m),
        _ => None,
    };
    let spin_y = constant("spin_rad_s").or(constant("spin_y_rad_s"));
    let values = [
        constant("start_time_s"),
        constant("spin_x_rad_s"),
        spin_y,
        constant("spin_z_rad_s"),
        area_per_mass,
        radius,
    ];
    values.map(|v| v.unwrap_or(f64::NAN)).to_vec()
}

/// Covariates of a record as the engine uses them; 0 where not recorded.
pub(super) fn values_or_zero(record: &Record) -> Covariates {
    let value = |i: usize| record.covariate(i).unwrap_or(0.0);
    Covariates {
        clock_s: value(CLOCK),
        spin_rad_s: [value(1), value(2), value(3)],
        area_per_mass_m2_kg: value(AREA_PER_MASS),
    }
}

/// Radius of the ball in a record, m; `None` where not recorded.
pub(super) fn radius_m(record: &Record) -> Option<f64> {
    record.covariate(RADIUS)
}

/// Session time at the start of the record, s; 0 where not recorded.
pub(super) fn clock_s(record: &Record) -> f64 {
    record.covariate(CLOCK).unwrap_or(0.0)
}

/// Whether any of the records has a spin other than 0.
pub(super) fn has_spin(records: &[&Record]) -> bool {
    records.iter().any(|r| values_or_zero(r).spin_rad_s != [0.0; 3])
}

/// Whether every record has a session time of its start.
pub(super) fn has_start_time(records: &[&Record]) -> bool {
    !records.is_empty() && records.iter().all(|r| r.covariate(CLOCK).is_some())
}

/// Whether cross-section area per mass is known and differs between records by more than 5 %.
///
/// With equal balls a drag coefficient cannot be distinguished from a drag per metre.
pub(super) fn area_per_mass_varies(records: &[&Record]) -> bool {
    let ratios = || records.iter().map(|r| values_or_zero(r).area_per_mass_m2_kg);
    let (low, high) = (ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max));
    low > 0.0 && high > 1.05 * low
}

/// Covariates of `record` at session time 0, with the spin `spin_rad_s` about y, rad/s.
pub(super) fn with_spin(record: &Record, spin_rad_s: f64) -> Vec<f64> {
    let mut values = record.covariates.clone();
    for (i, value) in [(CLOCK, 0.0), (1, 0.0), (2, spin_rad_s), (3, 0.0)] {
        if let Some(slot) = values.get_mut(i) {
            *slot = value;
        }
    }
    values
}
