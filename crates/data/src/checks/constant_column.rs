//! A column of motion that never changes.

use super::{Expected, Finding};
use crate::dataset::Dataset;

/// Columns that tell how something moves. The rod's coordinates are none of them: it often moves along an axis.
const MOTION: [&str; 6] = ["height_m", "velocity_m_s", "x_m", "y_m", "z_m", "theta_rad"];
/// Fewest samples of which it can be told.
const FEWEST: usize = 3;

/// Such columns whose measured values are all the same, digit by digit.
pub(super) fn look(data: &Dataset, _: &Expected) -> Vec<Finding> {
    let motion = data.columns().iter().enumerate().filter(|(_, c)| MOTION.contains(&c.name()));
    motion
        .filter_map(|(i, column)| {
            let mut values =
                data.trajectories().iter().flat_map(|t| t.column(i)).copied().filter(|v| v.is_finite());
            let value = values.next()?;
            let samples = values.clone().count() + 1;
            (samples >= FEWEST && values.all(|v| v == value)).then(|| Finding::ConstantColumn {
                column: column.name().to_owned(),
                value,
                samples,
            })
        })
        .collect()
}
