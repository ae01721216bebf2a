//! Check for a position, an angle or a velocity that is constant.

use super::{ExpectedData, Finding};
use crate::dataset::Dataset;

/// Names of the columns that describe a motion and are tested for being constant.
///
/// Coordinates of the rod are not among them, because it often moves along an axis.
const MOTION_COLUMNS: [&str; 6] = ["height_m", "velocity_m_s", "x_m", "y_m", "z_m", "theta_rad"];
/// Minimum number of measured samples of a column for a finding.
const MIN_SAMPLES: usize = 3;

/// Finds the positions, angles and velocities whose measured values are all equal.
pub(super) fn run(data: &Dataset, _: &ExpectedData) -> Vec<Finding> {
    let motion = data.columns().iter().enumerate().filter(|(_, c)| MOTION_COLUMNS.contains(&c.name()));
    motion
        .filter_map(|(i, column)| {
            let mut values =
                data.trajectories().iter().flat_map(|t| t.column(i)).copied().filter(|v| v.is_finite());
            let value = values.next()?;
            let samples = values.clone().count() + 1;
            (samples >= MIN_SAMPLES && values.all(|v| v == value)).then(|| Finding::ConstantColumn {
                column: column.name().to_owned(),
                value,
                samples,
            })
        })
        .collect()
}
