//! Covariates of a whole throw: start on the session's clock, spin, size and mass.

use super::Covariates;
use crate::system::{Quantity, Record};
use std::f64::consts::PI;

/// Covariates of a ball's record, in their order: name and unit.
const COVARIATES: [(&str, &str); 6] = [
    ("clock", "s"),
    ("spin_x", "rad/s"),
    ("spin_y", "rad/s"),
    ("spin_z", "rad/s"),
    ("area_per_mass", "m²/kg"),
    ("radius", "m"),
];
/// Place of the clock among the covariates.
pub(super) const CLOCK: usize = 0;
/// Place of the area per mass among the covariates.
const AREA_PER_MASS: usize = 4;
/// Place of the radius among the covariates.
const RADIUS: usize = 5;

/// The covariates, as the schema lists them.
pub(super) fn quantities() -> Vec<Quantity> {
    COVARIATES.iter().map(|(name, unit)| Quantity::new(name, unit)).collect()
}

/// The covariates by the constant columns of a trajectory; NaN where not recorded.
pub(super) fn read(constant: &dyn Fn(&str) -> Option<f64>) -> Vec<f64> {
    let radius = constant("radius_m");
    let area_per_mass = match (radius, constant("mass_kg")) {
        (Some(r), Some(m)) if m > 0.0 => Some(PI * r * r / m),
        _ => None,
    };
    let spin_y = constant("spin_rad_s").or(constant("spin_y_rad_s"));
    let all = [
        constant("start_time_s"),
        constant("spin_x_rad_s"),
        spin_y,
        constant("spin_z_rad_s"),
        area_per_mass,
        radius,
    ];
    all.map(|v| v.unwrap_or(f64::NAN)).to_vec()
}

/// The covariates of a record, 0 where one was not recorded.
pub(super) fn known(record: &Record) -> Covariates {
    let at = |i: usize| record.covariate(i).unwrap_or(0.0);
    Covariates {
        clock_s: at(CLOCK),
        spin_rad_s: [at(1), at(2), at(3)],
        area_per_mass_m2_kg: at(AREA_PER_MASS),
    }
}

/// The radius of the ball, m, where it was recorded.
pub(super) fn radius_m(record: &Record) -> Option<f64> {
    record.covariate(RADIUS)
}

/// Start of the record on the clock of the session, s; 0 where it was not recorded.
pub(super) fn clock_s(record: &Record) -> f64 {
    record.covariate(CLOCK).unwrap_or(0.0)
}

/// Whether any ball spins.
pub(super) fn has_spin(records: &[&Record]) -> bool {
    records.iter().any(|r| known(r).spin_rad_s != [0.0; 3])
}

/// Whether every record has its start on the clock of the session.
pub(super) fn has_start_time(records: &[&Record]) -> bool {
    !records.is_empty() && records.iter().all(|r| r.covariate(CLOCK).is_some())
}

/// Whether size and mass are known and make a difference: in balls that are all alike a coefficient is what drag per metre is.
pub(super) fn area_per_mass_varies(records: &[&Record]) -> bool {
    let ratios = || records.iter().map(|r| known(r).area_per_mass_m2_kg);
    let (low, high) = (ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max));
    low > 0.0 && high > 1.05 * low
}

/// The covariates of `record` with another spin about y, rad/s, at the beginning of the session's clock.
pub(super) fn with_spin(record: &Record, spin_rad_s: f64) -> Vec<f64> {
    let mut values = record.covariates.clone();
    for (i, value) in [(CLOCK, 0.0), (1, 0.0), (2, spin_rad_s), (3, 0.0)] {
        if let Some(slot) = values.get_mut(i) {
            *slot = value;
        }
    }
    values
}
