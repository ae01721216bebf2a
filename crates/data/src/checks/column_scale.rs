//! One coordinate in another unit than the others of its frame, or than the rod.

use super::measured::{FRAMES, Series, rod_path};
use super::{Expected, Finding};
use crate::dataset::Dataset;

/// Ratio of the noise of two coordinates; centimetres are a factor of 100. In the measured sets the largest is 10, of a rod
/// (mit-pnpush-pushes) that moves along one axis by a clock that jitters.
const NOISE: f64 = 30.0;
/// Ratio of their spans, so that a direction that is badly seen and hardly used is none.
const SPAN: f64 = 10.0;
/// How many times the rod's path an object can move. In the measured sets the largest is 0.91, steel at 200 mm/s included.
const OUTRUN: f64 = 5.0;
/// Share of the pushes in which it must, per cent.
const OUTRUN_SHARE: usize = 20;

/// Coordinates of one frame against the quietest of them, and the object's against the rod's.
pub(super) fn look(data: &Dataset, _: &Expected) -> Vec<Finding> {
    let mut findings: Vec<Finding> = FRAMES.iter().flat_map(|frame| within(data, frame)).collect();
    findings.extend(["x_m", "y_m"].iter().filter_map(|column| outruns(data, column)));
    findings
}

fn within(data: &Dataset, frame: &[&str]) -> Vec<Finding> {
    let known: Vec<(Series<'_>, f64, f64)> = frame
        .iter()
        .filter_map(|name| {
            let series = Series::named(data, name)?;
            Some((series, series.noise()?, series.typical_span()?))
        })
        .collect();
    let Some(quiet) = known.iter().min_by(|a, b| a.1.total_cmp(&b.1)) else { return Vec::new() };
    known
        .iter()
        .filter(|(_, noise, span)| *noise > NOISE * quiet.1 && *span > SPAN * quiet.2)
        .map(|(series, noise, span)| Finding::ColumnScale {
            column: series.name().to_owned(),
            reference: quiet.0.name().to_owned(),
            span: span / quiet.2.max(f64::MIN_POSITIVE),
            noise: noise / quiet.1,
        })
        .collect()
}

fn outruns(data: &Dataset, column: &str) -> Option<Finding> {
    let series = Series::named(data, column)?;
    let pushes = data.trajectories().iter().filter_map(|t| {
        let rod_m = rod_path(data, t).filter(|path| *path > 0.0)?;
        Some((t, series.span(t)?, rod_m))
    });
    let (mut first, mut count, mut total) = (None, 0, 0);
    for (t, object_m, rod_m) in pushes {
        total += 1;
        if object_m > OUTRUN * rod_m {
            count += 1;
            first.get_or_insert((t, object_m, rod_m));
        }
    }
    let share = 100 * count / total.max(1);
    let (t, object_m, rod_m) = first.filter(|_| share >= OUTRUN_SHARE)?;
    Some(Finding::ObjectOutrunsRod {
        trajectory: t.id().to_owned(),
        column: column.to_owned(),
        object_m,
        rod_m,
        share,
    })
}
