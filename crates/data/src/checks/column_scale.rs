//! Check for a coordinate in another unit than the others of its frame, or than the rod.

use super::measured::{FRAMES, Series, rod_path};
use super::{ExpectedData, Finding};
use crate::dataset::Dataset;

/// Maximum ratio of the noise of two coordinates in the same unit; centimetres are a factor of 100.
///
/// The largest ratio in the measured sets is 10, of a rod (mit-pnpush-pushes) that moves along one axis and
/// whose time stamps jitter.
const MAX_NOISE_RATIO: f64 = 30.0;
/// Maximum ratio of the spans of two coordinates in the same unit.
///
/// A coordinate is in another unit only if its noise and its span are both too large: a noisy direction in which hardly
/// anything moves is in the same unit.
const MAX_SPAN_RATIO: f64 = 10.0;
/// Maximum ratio of the object's motion to the path of the rod that pushes it.
///
/// The largest ratio in the measured sets is 0.91, including steel at 200 mm/s.
const MAX_OBJECT_RATIO: f64 = 5.0;
/// Minimum share of the pushes, per cent, that exceed `MAX_OBJECT_RATIO` for a finding.
const MIN_SHARE: usize = 20;

/// Finds coordinates in another unit.
///
/// Each coordinate is compared with the least noisy one of its frame, and the motion of the object with the path of the
/// rod.
pub(super) fn run(data: &Dataset, _: &ExpectedData) -> Vec<Finding> {
    let mut findings: Vec<Finding> = FRAMES.iter().flat_map(|frame| compare_in_frame(data, frame)).collect();
    findings.extend(["x_m", "y_m"].iter().filter_map(|column| compare_with_rod(data, column)));
    findings
}

fn compare_in_frame(data: &Dataset, frame: &[&str]) -> Vec<Finding> {
    let known: Vec<(Series<'_>, f64, f64)> = frame
        .iter()
        .filter_map(|name| {
            let series = Series::named(data, name)?;
            Some((series, series.noise()?, series.typical_span()?))
        })
        .collect();
    let Some(quietest) = known.iter().min_by(|a, b| a.1.total_cmp(&b.1)) else { return Vec::new() };
    known
        .iter()
        .filter(|(_, noise, span)| {
            *noise > MAX_NOISE_RATIO * quietest.1 && *span > MAX_SPAN_RATIO * quietest.2
        })
        .map(|(series, noise, span)| Finding::ColumnScale {
            column: series.name().to_owned(),
            reference: quietest.0.name().to_owned(),
            span: span / quietest.2.max(f64::MIN_POSITIVE),
            noise: noise / quietest.1,
        })
        .collect()
}

fn compare_with_rod(data: &Dataset, column: &str) -> Option<Finding> {
    let series = Series::named(data, column)?;
    let pushes = data.trajectories().iter().filter_map(|t| {
        let rod_m = rod_path(data, t).filter(|path| *path > 0.0)?;
        Some((t, series.span(t)?, rod_m))
    });
    let (mut first, mut count, mut total) = (None, 0, 0);
    for (t, object_m, rod_m) in pushes {
        total += 1;
        if object_m > MAX_OBJECT_RATIO * rod_m {
            count += 1;
            first.get_or_insert((t, object_m, rod_m));
        }
    }
    let share = 100 * count / total.max(1);
    let (t, object_m, rod_m) = first.filter(|_| share >= MIN_SHARE)?;
    Some(Finding::ObjectOutrunsRod {
        trajectory: t.id().to_owned(),
        column: column.to_owned(),
        object_m,
        rod_m,
        share,
    })
}
