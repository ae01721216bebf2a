//! Check for a few trajectories whose clock is in another unit than that of the others.
//!
//! Another unit of the clock changes only the time step: the trajectory has about as many samples as the
//! others, and its columns change equally from sample to sample. With another sample rate the columns would
//! change more or less.

use super::clock_unit::ClockUnit;
use super::measured::Series;
use super::{ExpectedData, Finding};
use crate::dataset::Dataset;
use crate::statistics::median;
use crate::trajectory::Trajectory;

/// Maximum relative difference between the ratio of two time steps and the ratio of two units of time.
///
/// A step of at least 5 ms that is rounded to whole milliseconds has an error of at most 10 %.
const RATIO_TOLERANCE: f64 = 0.1;
/// Maximum ratio of two time steps that different sample rates explain.
///
/// The same limit holds for the ratio of two numbers of samples. It is the square root of 60, the smallest
/// ratio of two units, so that a step below it is nearer to the others than to another unit.
const MAX_RATE_RATIO: f64 = 7.745_966_692;
/// Maximum ratio at which two changes per sample count as equal; same value as `mixed_units::MIN_BEND_RATIO`.
const MAX_CHANGE_RATIO: f64 = 3.0;
/// Minimum span of a column, relative to its change per sample, for the column to reveal the sample rate.
///
/// Samples that are 60 or more usual steps apart can be anywhere within the span, and two numbers drawn
/// uniformly from a range differ by a third of it on average. That exceeds 3 usual changes
/// (`MAX_CHANGE_RATIO`) where the span is more than 9 of them.
const MIN_SMOOTHNESS: f64 = 9.0;
/// Maximum share of trajectories with an unusual clock for a finding; same value as in `mixed_units`.
const MAX_EXCEPTIONS: f64 = 1.0 / 3.0;
/// Minimum number of trajectories with the usual time step for a finding; same value as in `mixed_units`.
const MIN_OTHERS: usize = 3;

/// Finds the trajectories whose time step equals that of the others if their clock is in another unit.
pub(super) fn run(data: &Dataset, _: &ExpectedData) -> Vec<Finding> {
    find(data).into_iter().collect()
}

fn find(data: &Dataset) -> Option<Finding> {
    let all = data.trajectories();
    let steps: Vec<Option<f64>> = all.iter().map(typical_step).collect();
    let usual = median(&mut steps.iter().flatten().copied().collect::<Vec<_>>())?;
    let is_usual = |step: f64| is_within(step / usual, MAX_RATE_RATIO);
    let with_step = || steps.iter().enumerate().filter_map(|(j, step)| Some((j, (*step)?)));
    let (others, rare): (Vec<_>, Vec<_>) = with_step().partition(|(_, step)| is_usual(*step));
    let is_exception = !rare.is_empty() && rare.len() as f64 <= MAX_EXCEPTIONS * all.len() as f64;
    if !is_exception || others.len() < MIN_OTHERS {
        return None;
    }
    let mut others_steps: Vec<f64> = others.iter().map(|o| o.1).collect();
    let others_step_s = median(&mut others_steps)?;
    others_steps.sort_unstable_by(f64::total_cmp);
    // Where other ratios occur as well, the sample rates were chosen individually.
    let units: Vec<_> = rare.iter().map(|r| unit_between(r.1, &others_steps)).collect::<Option<_>>()?;
    let usual_length = median(&mut others.iter().map(|o| all[o.0].len() as f64).collect::<Vec<_>>())?;
    let columns: Vec<UsualChange<'_>> = (0..data.columns().len())
        .filter_map(|i| UsualChange::from_series(Series::of_column(data, i), data, &others))
        .collect();
    let is_other_unit = |j: usize| {
        is_within(all[j].len() as f64 / usual_length, MAX_RATE_RATIO) && changes_alike(&columns, &all[j])
    };
    let different: Vec<((usize, f64), ClockUnit)> =
        rare.into_iter().zip(units).filter(|((j, _), _)| is_other_unit(*j)).collect();
    let &((first, step_s), unit) = different.first()?;
    let is_slower = |step: f64| step > others_step_s;
    let is_like_first = |((_, step), other): &((usize, f64), ClockUnit)| {
        *other == unit && is_slower(*step) == is_slower(step_s)
    };
    Some(Finding::MixedClock {
        trajectory: all[first].id().to_owned(),
        step_s,
        others_step_s,
        unit,
        others: others.len(),
        alike: different.iter().filter(|u| is_like_first(u)).count(),
    })
}

/// Whether both `ratio` and its inverse are at most `max_ratio`.
fn is_within(ratio: f64, max_ratio: f64) -> bool {
    ratio <= max_ratio && ratio * max_ratio >= 1.0
}

/// Median time step of a trajectory, s; `None` for fewer than two samples.
fn typical_step(t: &Trajectory) -> Option<f64> {
    median(&mut t.time_s().windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>())
}

/// Unit, of this clock or of the other clocks, in which `step` equals one of the sorted `others`.
fn unit_between(step: f64, others: &[f64]) -> Option<ClockUnit> {
    let is_ratio = |ratio: f64| {
        let nearest = others.partition_point(|o| step / o / ratio > 1.0 + RATIO_TOLERANCE);
        others.get(nearest).is_some_and(|o| step / o / ratio >= 1.0 - RATIO_TOLERANCE)
    };
    ClockUnit::ALL
        .into_iter()
        .find(|unit| is_ratio(unit.times_per_second()) || is_ratio(1.0 / unit.times_per_second()))
}

/// Span and change per sample of a column in the trajectories with the usual time step.
struct UsualChange<'a> {
    series: Series<'a>,
    /// Median over the trajectories of the span of the column.
    span: f64,
    /// Median over the trajectories of the mean absolute change of the column per sample.
    step: f64,
}

impl<'a> UsualChange<'a> {
    /// Usual span and change of a column; `None` if it changes too much per sample to reveal the sample rate.
    fn from_series(series: Series<'a>, data: &Dataset, others: &[(usize, f64)]) -> Option<Self> {
        let changes = || others.iter().filter_map(|o| span_and_step(series, &data.trajectories()[o.0]));
        let span = median(&mut changes().map(|c| c.0).collect::<Vec<_>>())?;
        let step = median(&mut changes().map(|c| c.1).collect::<Vec<_>>())?;
        (step > 0.0 && span >= MIN_SMOOTHNESS * step).then_some(UsualChange { series, span, step })
    }
}

/// Span and mean absolute change per sample of a column in a trajectory; `None` for a constant column.
fn span_and_step(series: Series<'_>, t: &Trajectory) -> Option<(f64, f64)> {
    let span = series.span(t)?;
    let (_, values) = series.samples(t);
    let path_length: f64 = values.windows(2).map(|w| (w[1] - w[0]).abs()).sum();
    (span > 0.0 && path_length > 0.0).then(|| (span, path_length / (values.len() - 1) as f64))
}

/// Whether most columns have their usual span and change per sample in the trajectory `t`.
///
/// Not all need to, because an input may have another amplitude.
fn changes_alike(columns: &[UsualChange<'_>], t: &Trajectory) -> bool {
    let outcomes = columns.iter().filter_map(|usual| {
        let (span, step) = span_and_step(usual.series, t)?;
        let is_equal = |ratio: f64| is_within(ratio, MAX_CHANGE_RATIO);
        Some(is_equal(span / usual.span) && is_equal(step / usual.step))
    });
    outcomes.map(|is_alike| if is_alike { 1 } else { -1 }).sum::<i32>() > 0
}
