//! Check for a few trajectories in another unit than the others.
//!
//! Another unit scales the span, the curvature and the noise of a trajectory by the same factor. A trajectory
//! that only goes far, such as a pendulum that makes full turns, has the curvature and the noise of the
//! others.

use super::measured::Series;
use super::{ExpectedData, Finding};
use crate::dataset::Dataset;
use crate::statistics::median;

/// Minimum span of a trajectory in another unit, relative to the range of all values of the others.
///
/// Centimetres are a factor of 100, and different initial values reduce the ratio by a factor of up to 5. The
/// largest ratio in the measured sets is 1.1.
const MIN_SPAN_RATIO: f64 = 10.0;
/// Minimum median second difference of a trajectory in another unit, relative to that of the others.
const MIN_BEND_RATIO: f64 = 3.0;
/// Maximum ratio of span to second difference of a trajectory in another unit, both relative to the others.
const MAX_SPAN_OVER_BEND: f64 = 10.0;
/// Maximum share of trajectories in another unit for a finding.
const MAX_EXCEPTIONS: f64 = 1.0 / 3.0;
/// Minimum number of trajectories in the usual unit for a finding.
const MIN_OTHERS: usize = 3;

/// Finds, for each column, the few trajectories that are in another unit.
pub(super) fn run(data: &Dataset, _: &ExpectedData) -> Vec<Finding> {
    (0..data.columns().len()).filter_map(|i| exception(data, Series::of_column(data, i))).collect()
}

/// Finds the trajectories of a column whose span is over 10 times the range of all with smaller spans.
///
/// They are probably in another unit if their second differences are larger as well. The trajectories are sorted by
/// span, and at most a third of them may be in another unit.
fn exception(data: &Dataset, series: Series<'_>) -> Option<Finding> {
    let numbered = data.trajectories().iter().enumerate();
    let mut spans: Vec<(f64, usize)> = numbered.filter_map(|(j, t)| Some((series.span(t)?, j))).collect();
    spans.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let min_others = spans.len() - (MAX_EXCEPTIONS * spans.len() as f64) as usize;
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for (place, &(_, j)) in spans.iter().enumerate() {
        let width = range[1] - range[0];
        if place >= min_others.max(MIN_OTHERS) && width > 0.0 && spans[place].0 > MIN_SPAN_RATIO * width {
            let others = &spans[..place];
            let wide = with_larger_bend(data, series, others, &spans[place..]);
            let first = wide.iter().map(|s| s.1).min()?;
            let median_span =
                |part: &[(f64, usize)]| median(&mut part.iter().map(|s| s.0).collect::<Vec<_>>());
            let span = series.span(&data.trajectories()[first])?;
            return Some(Finding::MixedUnits {
                trajectory: data.trajectories()[first].id().to_owned(),
                column: series.name().to_owned(),
                unit: series.unit(),
                span,
                others_span: width,
                factor: median_span(&wide)? / median_span(others)?.max(f64::MIN_POSITIVE),
                others: place,
                alike: wide.len(),
            });
        }
        for v in series.samples(&data.trajectories()[j]).1 {
            range = [range[0].min(v), range[1].max(v)];
        }
    }
    None
}

/// Keeps the trajectories of `wide` whose median second difference also exceeds that of the `others`.
///
/// Both lists hold (span, index of the trajectory). All of `wide` are returned where the second differences of the
/// others are 0.
fn with_larger_bend(
    data: &Dataset,
    series: Series<'_>,
    others: &[(f64, usize)],
    wide: &[(f64, usize)],
) -> Vec<(f64, usize)> {
    let bend = |j: usize| {
        let (_, values) = series.samples(&data.trajectories()[j]);
        median(&mut values.windows(3).map(|v| (v[0] - 2.0 * v[1] + v[2]).abs()).collect::<Vec<_>>())
    };
    let typical = median(&mut others.iter().filter_map(|o| bend(o.1)).collect::<Vec<_>>());
    let typical = typical.filter(|bend| *bend > 0.0);
    let span = median(&mut others.iter().map(|o| o.0).collect::<Vec<_>>()).filter(|span| *span > 0.0);
    let has_usual_bend = |&(wide, j): &(f64, usize)| {
        let span_ratio = span.map_or(0.0, |span| wide / span);
        let min_ratio = MIN_BEND_RATIO.max(span_ratio / MAX_SPAN_OVER_BEND);
        bend(j).zip(typical).is_some_and(|(bend, typical)| bend < min_ratio * typical)
    };
    wide.iter().filter(|w| !has_usual_bend(w)).copied().collect()
}
