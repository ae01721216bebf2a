//! The protocol `filtered`: every model observes the same noisy first rows and forecasts the remaining ones.

use super::prefix::{FilterSettings, Prefix, PrefixForecaster};
use super::score::{FilteredScore, tally_forecast};
use super::{InitialStatePrior, Sensor};
use crate::collect_in_order;
use crate::score::Scoring;
use crate::{Samples, Sequence, Sequences, TrainerError};
use augsim_data::random_stream;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Repeats the prefix lengths `rows` for each of `trajectories` trajectories, `[trajectory][prefix]`.
pub fn same_prefix_lengths(rows: &[usize], trajectories: usize) -> Vec<Vec<usize>> {
    vec![rows.to_vec(); trajectories]
}

/// Scores a model's forecasts after prefixes (first rows) of `lengths [trajectory][prefix]` rows, ascending.
/// A trajectory that is not longer than a prefix is left out of the score for that prefix. The true states
/// are those of `test`; the model observes them with simulated measurement noise, or as they are where they
/// are measured.
///
/// # Errors
/// [`TrainerError`] if the model cannot be run, or there is nothing to score.
pub fn evaluate_filtered(
    model: &dyn PrefixForecaster,
    test: &Sequences,
    known: (&Sensor, &InitialStatePrior),
    lengths: &[Vec<usize>],
    settings: FilterSettings,
) -> Result<Vec<FilteredScore>, TrainerError> {
    let scoring = Scoring::for_columns(test);
    let score = |index: usize, n: usize, samples: Samples| {
        tally_forecast(&samples, &test.items[index].states, n, &scoring)
    };
    let scores = map_forecasts(model, test, known, (lengths, settings), &score)?;
    (0..lengths.first().map_or(0, Vec::len))
        .map(|k| {
            let tallies: Vec<_> = scores.iter().filter_map(|forecasts| forecasts.get(k).cloned()).collect();
            match tallies.is_empty() {
                true => Err(TrainerError::NoTrajectories {
                    what: "the part of the test set that is longer than the prefix",
                }),
                false => Ok(FilteredScore::from_tallies(&tallies)),
            }
        })
        .collect()
}

/// Applies `visit` to every forecast of a set, `[trajectory][prefix shorter than the trajectory]`.
/// `visit` receives the trajectory's index, the number of observed rows, and the forecast. Trajectories run
/// in parallel; the results are in their order.
pub(super) fn map_forecasts<T: Send>(
    model: &dyn PrefixForecaster,
    set: &Sequences,
    (sensor, start): (&Sensor, &InitialStatePrior),
    (lengths, settings): (&[Vec<usize>], FilterSettings),
    visit: &(dyn Fn(usize, usize, Samples) -> T + Sync),
) -> Result<Vec<Vec<T>>, TrainerError> {
    let results = (set.items.par_iter().zip(lengths).enumerate()).map(
        |(index, (q, lengths))| -> Result<Vec<T>, TrainerError> {
            let usable_lengths: Vec<usize> = lengths.iter().copied().filter(|n| *n < q.time).collect();
            let noise = (!settings.is_measured).then_some(settings.seed);
            let rows = measured_rows(q, sensor, noise, index as u64);
            let prefix = Prefix {
                id: &q.id,
                rows: &rows[..usable_lengths.last().copied().unwrap_or(0) * sensor.sd().len()],
                sensor,
                start,
                actions: &q.actions,
                time: q.time,
                index: index as u64,
            };
            let forecasts = model.forecasts(prefix, &usable_lengths, settings)?;
            Ok(forecasts
                .into_iter()
                .zip(usable_lengths)
                .map(|(samples, n)| visit(index, n, samples))
                .collect())
        },
    );
    collect_in_order(results)
}

/// Returns rows `[T, S]` of a trajectory with simulated measurement noise; NaN in unobserved columns.
/// Each trajectory and seed has its own noise stream.
/// Without a seed the rows are measurements already and no noise is added.
pub fn measured_rows(q: &Sequence, sensor: &Sensor, seed: Option<u64>, index: u64) -> Vec<f64> {
    let mut rng = random_stream(seed.unwrap_or_default(), "sensor", index);
    let scale = if seed.is_some() { 1.0 } else { 0.0 };
    let mut rows = q.states.clone();
    for row in rows.chunks_exact_mut(sensor.sd().len()) {
        for (value, sd) in row.iter_mut().zip(sensor.sd()) {
            let draw: f64 = StandardNormal.sample(&mut rng);
            *value = match sd {
                Some(sd) => *value + scale * sd * draw,
                // The model must not receive a column that the sensor does not observe.
                None => f64::NAN,
            };
        }
    }
    rows
}
