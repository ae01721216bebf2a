//! Values that no measurement in SI units can have.

use super::{Expected, Finding};
use crate::dataset::Dataset;

/// Largest value that passes. Times since 1970 are 2e9 s, pressures in diamond cells 1e12 Pa.
const LARGEST: f64 = 1e12;

/// The first such value of each column.
pub(super) fn look(data: &Dataset, _: &Expected) -> Vec<Finding> {
    let first = |(i, column): (usize, &crate::Column)| {
        data.trajectories().iter().find_map(|t| {
            let k = t.column(i).iter().position(|v| v.abs() > LARGEST)?;
            Some(Finding::AbsurdValue {
                trajectory: t.id().to_owned(),
                time_s: t.time_s()[k],
                column: column.name().to_owned(),
                unit: column.unit().symbol().to_owned(),
                value: t.column(i)[k],
            })
        })
    };
    data.columns().iter().enumerate().filter_map(first).collect()
}
