//! A declared sensor noise that the data contradict so far that a unit must be wrong.

use super::measured::Series;
use super::{Expected, Finding};
use crate::dataset::Dataset;

/// Declared noise, in units of the typical span of the motion, beneath which nothing could be seen.
const DROWNS: f64 = 0.1;
/// Declared noise, in units of that of the data, from which discovery takes it for a tolerance (there `TOLERANCE`).
const COARSE: f64 = 20.0;

/// The positions against `position_sd_m`, the angle against `angle_sd_rad`.
pub(super) fn look(data: &Dataset, expected: &Expected) -> Vec<Finding> {
    let positions = ["height_m", "x_m", "y_m", "z_m"];
    let compare =
        |columns, key, unit, sd| compare(data, columns, (key, unit, sd), expected.gravity_m_s2.is_some());
    let position = expected.position_sd_m.and_then(|sd| compare(&positions[..], "position_sd_m", "m", sd));
    let angle = expected.angle_sd_rad.and_then(|sd| compare(&["theta_rad"][..], "angle_sd_rad", "rad", sd));
    position.into_iter().chain(angle).collect()
}

/// The column that moves furthest tells what can be seen at all. Only of a ball (`falls`) a coarse declaration is a
/// tolerance: of a pushed object it is the accuracy of the tracker, whose neighbouring samples scatter far less.
fn compare(
    data: &Dataset,
    columns: &[&str],
    (key, unit, declared): (&'static str, &'static str, f64),
    falls: bool,
) -> Option<Finding> {
    let known = columns.iter().filter_map(|name| {
        let series = Series::named(data, name)?;
        Some((series, series.noise()?, series.typical_span()?))
    });
    let (series, found, span) = known.max_by(|a, b| a.2.total_cmp(&b.2))?;
    let column = series.name().to_owned();
    match declared > COARSE * found {
        true if declared > DROWNS * span => {
            Some(Finding::DeclaredNoise { key, column, unit, declared, found, span })
        }
        true if falls => Some(Finding::CoarseTolerance { key, column, unit, declared, found }),
        _ => None,
    }
}
