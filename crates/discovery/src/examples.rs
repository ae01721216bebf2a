//! Held-out records with the predictions of the declared, calibrated and augmented model, for display.

use crate::error_table::ForecastErrors;
use crate::fit::{ChosenRecords, Fit};
use crate::forecast;
use crate::hypothesis::Hypothesis;
use crate::result::{Example, ExampleChannel};

/// Maximum number of samples of an example record, as many as a figure can show.
const MAX_SAMPLES: usize = 400;

/// Indices of the best, median and worst prediction with their ranks, by the second of each pair of errors.
/// Fewer than three for fewer than three finite errors.
pub(crate) fn ranked(errors: &[[f64; 2]]) -> Vec<(usize, &'static str)> {
    let mut order: Vec<usize> = (0..errors.len()).filter(|&i| errors[i][1].is_finite()).collect();
    order.sort_by(|&a, &b| errors[a][1].total_cmp(&errors[b][1]));
    let Some(last) = order.len().checked_sub(1) else { return Vec::new() };
    let mut chosen = vec![(order[0], "best")];
    if last >= 2 {
        chosen.push((order[last / 2], "median"));
    }
    if last >= 1 {
        chosen.push((order[last], "worst"));
    }
    chosen
}

/// Distance between displayed samples of a record of `count` samples, in samples.
pub(crate) fn stride(count: usize) -> usize {
    count.div_ceil(MAX_SAMPLES).max(1)
}

/// Returns the value if it is finite.
pub(crate) fn finite(value: f64) -> Option<f64> {
    Some(value).filter(|v| v.is_finite())
}

/// The best, the median and the worst prediction on held-out records, for display. `base` is the calibrated
/// model, whose nominal values are the declared ones; `best` is the final set of effects.
pub(crate) fn examples(
    test: &ChosenRecords<'_>,
    [base, best]: [&Fit; 2],
    lists: &ForecastErrors,
) -> Vec<Example> {
    let nominal = Hypothesis::new(test.data, &[]).initial_theta(0.0);
    let schema = test.data.system.schema();
    let (pieces, errors) = lists.errors_by_span();
    let one = |(place, rank): (usize, &str)| {
        let piece = &pieces[place];
        let record = &test.data.records[test.chosen[piece.chosen]];
        let declared = forecast::predicted_channels(test, piece, base, &nominal);
        let calibrated = forecast::predicted_channels(test, piece, base, &base.theta);
        let augmented = forecast::predicted_channels(test, piece, best, &best.theta);
        let (first, length) = (piece.samples.start, piece.samples.len());
        let step = stride(length);
        let shown = || (0..length).step_by(step);
        let known = if first == 0 { record.data.initial_sample_count } else { 1 };
        let times_s: Vec<f64> = shown().map(|k| record.data.times[first + k]).collect();
        let values = best.hypothesis.values_at(&best.theta, record.data.group);
        let scene = best.hypothesis.system.scene(&record.data, &times_s, &values);
        let channels = schema.channels.iter().enumerate().map(|(c, channel)| ExampleChannel {
            column: channel.column.clone(),
            unit: channel.unit.clone(),
            measured: shown()
                .map(|k| first + k)
                .map(|k| finite(record.data.values[c][k]).filter(|_| record.weight[c][k] > 0.0))
                .collect(),
            declared: shown().map(|k| finite(declared[c][k])).collect(),
            calibrated: shown().map(|k| finite(calibrated[c][k])).collect(),
            augmented: shown().map(|k| finite(augmented[c][k])).collect(),
        });
        Example {
            id: piece.name(record),
            rank: rank.into(),
            rmse: errors[place],
            times_s,
            known: known.div_ceil(step),
            channels: channels.collect(),
            scene,
        }
    };
    ranked(&errors).into_iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    //! Contract: best, median and worst are different records, by the error of the augmented model.
    use super::*;

    #[test]
    fn records_are_ranked_by_the_last_error() {
        let of = |list: &[f64]| ranked(&list.iter().map(|e| [0.0, *e]).collect::<Vec<_>>());
        assert_eq!(of(&[3.0, 1.0, 2.0, 9.0, f64::NAN]), [(1, "best"), (2, "median"), (3, "worst")]);
        assert_eq!(of(&[3.0, 1.0]), [(1, "best"), (0, "worst")]);
        assert_eq!(of(&[3.0]), [(0, "best")]);
        assert!(of(&[]).is_empty());
    }
}
