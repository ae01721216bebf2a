//! A few trajectories whose clock is in another unit than those of the rest.
//!
//! A clock in another unit stretches the time step and nothing else: the trajectory has about as many samples as the others, and its
//! columns change as much from one sample to the next. A trajectory that was truly sampled at another rate changes by more or less.

use super::clock_unit::ClockUnit;
use super::measured::Series;
use super::{Expected, Finding};
use crate::dataset::Dataset;
use crate::statistics::median;
use crate::trajectory::Trajectory;

/// Largest relative distance of a ratio of time steps from that of two units. A step of 5 ms or more that is rounded to whole
/// milliseconds is wrong by 10 % at most.
const RATIO_TOLERANCE: f64 = 0.1;
/// Ratio of two time steps, either way, up to which they are two sample rates: the square root of 60, which is the smallest ratio of
/// two units, so that a step lies nearer to the others than to another unit. Also the ratio of two numbers of samples.
const MAX_RATE_RATIO: f64 = 7.745_966_692;
/// Ratio of changes, either way, up to which they are alike; that of `mixed_units::BENDS`.
const MAX_CHANGE_RATIO: f64 = 3.0;
/// How many times the change from sample to sample the span of a column is at least, to tell one rate from another. Samples
/// that are 60 or more of the usual steps apart can be anywhere within the span, and two numbers that are drawn evenly from a range
/// differ by a third of it: 3 times the usual change, which is not alike, is a third of the span from 9 on.
const MIN_SMOOTHNESS: f64 = 9.0;
/// Largest share of the trajectories that can be the exception, as in `mixed_units`.
const MAX_EXCEPTIONS: f64 = 1.0 / 3.0;
/// Fewest trajectories that are a rule, as in `mixed_units`.
const MIN_OTHERS: usize = 3;

/// The trajectories whose time step is that of the others in another unit.
pub(super) fn look(data: &Dataset, _: &Expected) -> Vec<Finding> {
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
    // Where steps of many sizes occur, the rates were chosen one by one.
    let units: Vec<_> = rare.iter().map(|r| unit_between(r.1, &others_steps)).collect::<Option<_>>()?;
    let usual_length = median(&mut others.iter().map(|o| all[o.0].len() as f64).collect::<Vec<_>>())?;
    let columns: Vec<UsualChange<'_>> = (0..data.columns().len())
        .filter_map(|i| UsualChange::of(Series::at(data, i), data, &others))
        .collect();
    let is_other_unit = |j: usize| {
        is_within(all[j].len() as f64 / usual_length, MAX_RATE_RATIO) && changes_alike(&columns, &all[j])
    };
    let unlike: Vec<((usize, f64), ClockUnit)> =
        rare.into_iter().zip(units).filter(|((j, _), _)| is_other_unit(*j)).collect();
    let &((first, step_s), unit) = unlike.first()?;
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
        alike: unlike.iter().filter(|u| is_like_first(u)).count(),
    })
}

/// Whether `ratio` or its inverse is at most `most`.
fn is_within(ratio: f64, most: f64) -> bool {
    ratio <= most && ratio * most >= 1.0
}

/// Median time step, s.
fn typical_step(t: &Trajectory) -> Option<f64> {
    median(&mut t.time_s().windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>())
}

/// The unit of one of two clocks, this one or theirs, that makes `step` one of the steps of the others, which are in order.
fn unit_between(step: f64, others: &[f64]) -> Option<ClockUnit> {
    let is_ratio = |ratio: f64| {
        let nearest = others.partition_point(|o| step / o / ratio > 1.0 + RATIO_TOLERANCE);
        others.get(nearest).is_some_and(|o| step / o / ratio >= 1.0 - RATIO_TOLERANCE)
    };
    ClockUnit::LIST.into_iter().find(|unit| is_ratio(unit.excess()) || is_ratio(1.0 / unit.excess()))
}

/// How a column changes in the trajectories with the usual time step.
struct UsualChange<'a> {
    series: Series<'a>,
    /// Median of the spans.
    span: f64,
    /// Median of the mean changes from sample to sample.
    step: f64,
}

impl<'a> UsualChange<'a> {
    /// `None` for a column that is too rough to tell one sample rate from another.
    fn of(series: Series<'a>, data: &Dataset, others: &[(usize, f64)]) -> Option<Self> {
        let changes = || others.iter().filter_map(|o| span_and_step(series, &data.trajectories()[o.0]));
        let span = median(&mut changes().map(|c| c.0).collect::<Vec<_>>())?;
        let step = median(&mut changes().map(|c| c.1).collect::<Vec<_>>())?;
        (step > 0.0 && span >= MIN_SMOOTHNESS * step).then_some(UsualChange { series, span, step })
    }
}

/// Span, and mean change from one sample to the next; `None` for a column without change.
fn span_and_step(series: Series<'_>, t: &Trajectory) -> Option<(f64, f64)> {
    let span = series.span(t)?;
    let (_, values) = series.samples(t);
    let way: f64 = values.windows(2).map(|w| (w[1] - w[0]).abs()).sum();
    (span > 0.0 && way > 0.0).then(|| (span, way / (values.len() - 1) as f64))
}

/// Whether more columns change in `t` as they usually do than do not. An input may be of another size.
fn changes_alike(columns: &[UsualChange<'_>], t: &Trajectory) -> bool {
    let outcomes = columns.iter().filter_map(|usual| {
        let (span, step) = span_and_step(usual.series, t)?;
        let alike = |ratio: f64| is_within(ratio, MAX_CHANGE_RATIO);
        Some(alike(span / usual.span) && alike(step / usual.step))
    });
    outcomes.map(|alike| if alike { 1 } else { -1 }).sum::<i32>() > 0
}
