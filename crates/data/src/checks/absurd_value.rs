//! Check for values that are too large for any measurement in SI units.

use super::{ExpectedData, Finding};
use crate::dataset::Dataset;

/// Largest absolute value, in SI units, that counts as a possible measurement.
///
/// Times since 1970 are 2e9 s, pressures in diamond anvil cells 1e12 Pa.
const MAX_VALUE: f64 = 1e12;

/// Finds the first value of each column that exceeds `MAX_VALUE` in magnitude.
pub(super) fn run(data: &Dataset, _: &ExpectedData) -> Vec<Finding> {
    let first = |(i, column): (usize, &crate::Column)| {
        data.trajectories().iter().find_map(|t| {
            let k = t.column(i).iter().position(|v| v.abs() > MAX_VALUE)?;
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
