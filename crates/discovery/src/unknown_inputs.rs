//! Readings whose inputs lie before the recording: an input that acts late is not known for the first of them.

use crate::DiscoveryError;
use crate::estimate::with_three_digits;
use crate::fit::Fit;
use crate::prepare::Prepared;
use crate::stages::SearchStage;
use augsim_data::{Dataset, Trajectory};

/// The data without the readings whose inputs lie before the recording, because of a delay that the search found.
///
/// The input before the first sample is not known; a simulation takes the first value for it. `None` if there is no delay, or
/// if it is longer than half a recording.
///
/// # Errors
/// A trajectory that cannot be built, which does not occur.
pub(crate) fn without_unknown_inputs(
    prepared: &Prepared,
    searched: &SearchStage,
    data: &Dataset,
) -> Result<Option<(Dataset, String)>, DiscoveryError> {
    let delay_s = longest_delay_s(&searched.found.best().fit);
    let duration_s = |t: &Trajectory| t.time_s().last().zip(t.time_s().first()).map_or(0.0, |(b, a)| b - a);
    let is_short = |t: &Trajectory| delay_s > 0.5 * duration_s(t);
    if delay_s <= 0.0 || prepared.clock.is_over() || data.trajectories().iter().any(is_short) {
        return Ok(None);
    }
    let columns = prepared.data.system.schema().channels.iter().map(|c| data.column_index(&c.column));
    let columns: Vec<usize> = columns.collect::<Result<_, _>>()?;
    let later = |t: &Trajectory| {
        let first_s = t.time_s().first().map_or(0.0, |first| first + delay_s);
        let unknown = t.time_s().partition_point(|time| *time < first_s);
        let mut values = t.values().to_vec();
        columns.iter().for_each(|&column| values[column][..unknown].fill(f64::NAN));
        t.with_samples(t.time_s().to_vec(), values)
    };
    let trajectories = data.trajectories().iter().map(later).collect::<Result<Vec<_>, _>>()?;
    let note = format!(
        "the readings of the first {} s of each recording are left out, because an input acts as late as that: what it was before \
         the recording is not known",
        with_three_digits(delay_s)
    );
    Ok(Some((data.with_trajectories(trajectories)?, note)))
}

/// The longest delay of an input that a fit contains, s; 0 without one.
fn longest_delay_s(fit: &Fit) -> f64 {
    let additions = fit.hypothesis.additions.iter().enumerate();
    let delays = additions.filter(|(_, a)| a.depends_on_past() && !a.has_states());
    let values = delays.flat_map(|(number, _)| &fit.theta[fit.hypothesis.entries_of_addition(number)]);
    values.copied().fold(0.0, f64::max)
}
