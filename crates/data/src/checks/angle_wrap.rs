//! Check for angles that jump by a full turn, because the sensor returns them within one turn.
//!
//! A jump is a change by more than half a turn whose remainder after whole turns is like the changes beside it.
//! A set point that switches between two angles does not move beside its jump, and an angle that is not wrapped
//! leaves the range of one turn.

use super::measured::Series;
use super::{ExpectedData, Finding};
use crate::dataset::Dataset;
use crate::trajectory::Trajectory;
use crate::unit::Unit;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Maximum ratio at which two changes per sample count as similar; the same value as in `mixed_clock`.
const MAX_CHANGE_RATIO: f64 = 3.0;

/// Finds wrapped angles among the angles that the model reads, or among all angles without a model.
///
/// Angles of pushes are not checked, because they may wrap.
pub(super) fn run(data: &Dataset, expected: &ExpectedData) -> Vec<Finding> {
    if data.has_column("pusher_x_m") {
        return Vec::new();
    }
    let has_no_model = expected.outputs.is_empty() && expected.inputs.is_empty();
    let is_output = |name: &str| expected.outputs.iter().any(|o| o == name);
    let is_read = |name: &str| has_no_model || is_output(name) || expected.inputs.iter().any(|i| i == name);
    let is_wanted = |name: &str| is_read(name) && !expected.periodic.iter().any(|p| p == name);
    let angles = data.columns().iter().enumerate();
    angles
        .filter(|(_, c)| c.unit() == Unit::RADIAN && is_wanted(c.name()))
        .filter_map(|(index, c)| find(data, index, is_output(c.name())))
        .collect()
}

fn find(data: &Dataset, index: usize, is_output: bool) -> Option<Finding> {
    let series = Series::of_column(data, index);
    let (mut first, mut count, mut others) = (None, 0, 0);
    for t in data.trajectories() {
        let jumps = Jumps::of(series, t)?;
        count += jumps.turns.len();
        others += jumps.others;
        if let Some(time_s) = jumps.turns.first() {
            first.get_or_insert((t.id(), *time_s));
        }
    }
    let (trajectory, time_s) = first.filter(|_| count > others)?;
    Some(Finding::AngleWrap {
        trajectory: trajectory.to_owned(),
        time_s,
        column: series.name().to_owned(),
        jumps: count,
        is_output,
    })
}

/// Changes of an angle by more than half a turn from sample to sample, in one trajectory.
struct Jumps {
    /// Times of the jumps by full turns, s.
    turns: Vec<f64>,
    /// Number of jumps that are not by full turns.
    others: usize,
}

impl Jumps {
    /// Finds the jumps of an angle in a trajectory; `None` where the values span more than one turn.
    fn of(series: Series<'_>, t: &Trajectory) -> Option<Jumps> {
        let (times, values) = series.samples(t);
        let steps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
        let (mut turns, mut others) = (Vec::new(), 0);
        for (k, step) in steps.iter().enumerate().filter(|(_, step)| step.abs() > PI) {
            let remainder = step - (step / TAU).round() * TAU;
            let beside = [k.checked_sub(1).and_then(|k| steps.get(k)), steps.get(k + 1)];
            let largest = beside.into_iter().flatten().fold(0.0, |m: f64, s| m.max(s.abs()));
            match () {
                // A set point, or an angle that is unknown from sample to sample.
                () if largest == 0.0 || largest > FRAC_PI_2 => others += 1,
                () if remainder.abs() <= MAX_CHANGE_RATIO * largest => turns.push(times[k + 1]),
                () => others += 1,
            }
        }
        let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let small_step = steps.iter().map(|s| s.abs()).filter(|s| *s <= PI).fold(0.0, f64::max);
        (values.is_empty() || largest - smallest <= TAU + small_step).then_some(Jumps { turns, others })
    }
}
