//! Check for a declared measurement noise far above the noise of the data.

use super::measured::Series;
use super::{ExpectedData, Finding};
use crate::dataset::Dataset;

/// Maximum declared noise relative to the typical span of a column; with more, no motion would be visible.
const MAX_SPAN_SHARE: f64 = 0.1;
/// Maximum ratio of the declared noise to the noise of the data.
///
/// Above this ratio the discovery treats the declared noise as a tolerance (the constant `TOLERANCE` there).
const MAX_NOISE_RATIO: f64 = 20.0;

/// Compares the noise that the model declares for positions and for the angle with the noise of the data.
pub(super) fn run(data: &Dataset, expected: &ExpectedData) -> Vec<Finding> {
    let positions = ["height_m", "x_m", "y_m", "z_m"];
    let compare =
        |columns, key, unit, sd| compare(data, columns, (key, unit, sd), expected.gravity_m_s2.is_some());
    let position = expected.position_sd_m.and_then(|sd| compare(&positions[..], "position_sd_m", "m", sd));
    let angle = expected.angle_sd_rad.and_then(|sd| compare(&["theta_rad"][..], "angle_sd_rad", "rad", sd));
    position.into_iter().chain(angle).collect()
}

/// Compares a declared noise, as (key of the model file, unit, value), with the noise of the widest column.
///
/// The widest column is the one with the largest span. A coarse declaration is a tolerance only for falling objects
/// (`falls`). For a pushed object it is the accuracy of the tracker, whose neighbouring samples scatter far less.
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
    match declared > MAX_NOISE_RATIO * found {
        true if declared > MAX_SPAN_SHARE * span => {
            Some(Finding::DeclaredNoise { key, column, unit, declared, found, span })
        }
        true if falls => Some(Finding::CoarseTolerance { key, column, unit, declared, found }),
        _ => None,
    }
}
