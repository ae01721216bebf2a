//! Test whether an effect stands out of the scatter between repeats: recordings with the same inputs.
//!
//! Let `r_i(t)` be the residuals of repeat `i` of a set without the effect, `d_i(t)` the change of the predictions by it, both
//! divided by the noise, and `m_i(t)` the mean of the changes of the other repeats of the set. What follows from the inputs is
//! in `m_i`; what the fitted initial states of repeat `i` explain is only in `d_i`. A least-squares fit of `m_i` to `r_i` gives
//! the size of the effect in that repeat, as a share of that in the others: `s_i / e_i` with `s_i = sum_t r_i m_i` and
//! `e_i = sum_t m_i^2`. The size `a = sum_i s_i / sum_i e_i` of the `n` repeats of all sets has the standard error of a ratio
//! estimator (Cochran 1977, Sampling Techniques, section 6.3), with `n - 1` degrees of freedom:
//!
//! ```text
//! se^2 = n / (n - 1) sum_i (s_i - a e_i)^2 / (sum_i e_i)^2
//! ```
//!
//! What differs between repeats is no effect of the inputs, so an effect is not named if the 95 % interval of `a` contains zero.

use crate::addition::Addition;
use crate::record::ChosenRecords;
use crate::repeat_scatter::Repeats;
use crate::residuals::{RecordResiduals, record_residuals};
use crate::score::OUTSIDE_95;
use crate::search::{Search, SearchResult, without};
use crate::statistics::hotelling_tail;
use augsim_system::Record as SystemRecord;
use std::sync::Arc;

/// Share of an effect's change of the predictions above which repeats judge it: a half, so that the other recordings cannot
/// outweigh them.
const SHARE_IN_REPEATS: f64 = 0.5;

/// Number of the addition of a set that stands out least of the scatter between repeats; `None` if all stand out, or nothing
/// is repeated.
pub(super) fn within_scatter(search: &Search<'_>, found: &mut SearchResult, named: usize) -> Option<usize> {
    let set = found.sets[named].clone();
    if set.additions().is_empty() {
        return None;
    }
    let sample = search.sample();
    let (recordings, records_of) = recordings(&sample);
    let repeats = Repeats::find(&recordings);
    if repeats.is_empty() {
        return None;
    }
    let with_all = record_residuals(&sample, &set.fit);
    let mut worst: Option<(usize, f64)> = None;
    for (number, addition) in set.additions().iter().enumerate() {
        // A random effect does not change predictions.
        if matches!(addition, Addition::Scatter(_)) {
            continue;
        }
        let less = found.index_or_fit(search, &set, &without(set.additions(), number));
        let without_it = record_residuals(&sample, &found.sets[less].fit);
        let change = |records: &Vec<usize>| Change::new(&sample, records, [&without_it, &with_all]);
        let changes: Vec<Change> = records_of.iter().map(change).collect();
        let p_value = p_value(&repeats, &changes);
        if p_value > OUTSIDE_95 && worst.is_none_or(|(_, p)| p_value > p) {
            worst = Some((number, p_value));
        }
    }
    worst.map(|(number, _)| number)
}

/// Change of the predictions of one recording by an effect, sample by sample and channel by channel.
struct Change {
    /// Residuals without the effect, in standard deviations of the noise; NaN where a sample is not used.
    residuals: Vec<f64>,
    /// Change of the predictions by the effect, likewise.
    change: Vec<f64>,
}

impl Change {
    /// Collects the residuals of a recording's records without and with the effect.
    fn new(
        sample: &ChosenRecords<'_>,
        records: &[usize],
        [without_it, with_it]: [&[RecordResiduals]; 2],
    ) -> Self {
        let (mut residuals, mut change) = (Vec::new(), Vec::new());
        for &number in records {
            let record = &sample.data.records[sample.chosen[number]];
            for (channel, weights) in record.weight.iter().enumerate() {
                let [less, all] = [without_it, with_it].map(|of| &of[number].residuals[channel]);
                residuals.extend(weights.iter().zip(less).map(|(w, r)| w * r));
                change.extend(weights.iter().zip(less).zip(all).map(|((w, less), all)| w * (less - all)));
            }
        }
        Self { residuals, change }
    }

    /// Sum of the squared changes.
    fn energy(&self) -> f64 {
        self.change.iter().filter(|d| d.is_finite()).map(|d| d * d).sum()
    }
}

/// p-value of the size of an effect over repeats, given the changes of all recordings by it; 0 if no more than a half of the
/// changes is in repeats, 1 if the size is not positive.
fn p_value(repeats: &Repeats, changes: &[Change]) -> f64 {
    let energy_of_repeats: f64 = repeats.sets().flatten().map(|i| changes[*i].energy()).sum();
    if energy_of_repeats <= SHARE_IN_REPEATS * changes.iter().map(Change::energy).sum::<f64>() {
        return 0.0;
    }
    let products: Vec<[f64; 2]> = repeats
        .sets()
        .flat_map(|set| products(&set.iter().map(|i| &changes[*i]).collect::<Vec<_>>()))
        .collect();
    let count = products.len() as f64;
    let [total, energy] = [0, 1].map(|k| products.iter().map(|p| p[k]).sum::<f64>());
    let size = total / energy;
    if size.is_nan() || size <= 0.0 {
        return 1.0;
    }
    let scatter: f64 = products.iter().map(|[s, e]| (s - size * e).powi(2)).sum();
    hotelling_tail(total * total * (count - 1.0) / (count * scatter), 1, count - 1.0)
}

/// Sums `[s_i, e_i]` for each repeat of a set: its residuals without the effect times the mean change of the others, and that
/// mean squared.
fn products(set: &[&Change]) -> Vec<[f64; 2]> {
    let samples = set.iter().map(|repeat| repeat.change.len()).min().unwrap_or(0);
    let mut sums = vec![[0.0; 2]; set.len()];
    for k in 0..samples {
        let total: f64 = set.iter().map(|repeat| repeat.change[k]).sum();
        if total.is_finite() {
            for (sum, repeat) in sums.iter_mut().zip(set) {
                let of_others = (total - repeat.change[k]) / (set.len() - 1) as f64;
                sum[0] += repeat.residuals[k] * of_others;
                sum[1] += of_others * of_others;
            }
        }
    }
    sums
}

/// Recordings of a sample, and for each the numbers of the records that were cut from it. These share its inputs.
fn recordings(sample: &ChosenRecords<'_>) -> (Vec<SystemRecord>, Vec<Vec<usize>>) {
    let (mut recordings, mut records_of) = (Vec::<SystemRecord>::new(), Vec::<Vec<usize>>::new());
    for (number, record) in sample.records().enumerate() {
        let data = &record.data;
        match recordings.iter().position(|whole| Arc::ptr_eq(&whole.inputs, &data.inputs)) {
            Some(place) => {
                recordings[place].times.extend(&data.times);
                records_of[place].push(number);
            }
            None => {
                recordings.push(SystemRecord {
                    group: data.group,
                    times: data.times.clone(),
                    inputs: data.inputs.clone(),
                    covariates: data.covariates.clone(),
                    ..SystemRecord::default()
                });
                records_of.push(vec![number]);
            }
        }
    }
    (recordings, records_of)
}

#[cfg(test)]
mod tests {
    //! Contract: an effect that repeats share stands out, one that a single repeat has does not; recordings that are not
    //! repeated judge an effect that is mostly in them.
    use super::*;
    use augsim_system::Stream;

    fn input() -> Arc<[Stream]> {
        Arc::new([Stream { times: vec![0.0, 1.0], values: vec![vec![1.0, 2.0]] }])
    }

    /// p-value over recordings in which an effect changes one sample by 1, and which have these residuals without it. The
    /// first `repeats` repeat each other.
    fn p_value_of(residuals: &[f64], repeats: usize) -> f64 {
        let record = |i: usize| SystemRecord {
            times: vec![0.0, 1.0],
            covariates: vec![i.saturating_sub(repeats) as f64],
            inputs: input(),
            ..SystemRecord::default()
        };
        let records: Vec<_> = (1..=residuals.len()).map(record).collect();
        let changes: Vec<_> =
            residuals.iter().map(|r| Change { residuals: vec![*r], change: vec![1.0] }).collect();
        p_value(&Repeats::find(&records), &changes)
    }

    #[test]
    fn only_a_shared_effect_stands_out() {
        assert!(p_value_of(&[1.0, 1.1, 0.9, 1.0], 4) < 0.001);
        assert!(p_value_of(&[4.0, 0.0, 0.1, -0.1], 4) > 0.2);
        assert_eq!(p_value_of(&[-1.0; 3], 3), 1.0);
        // One-sample t of 2, 4 and 6 with two degrees of freedom: t = 3.4641, p = 0.0742.
        assert!((p_value_of(&[2.0, 4.0, 6.0], 3) - 0.0742).abs() < 1e-4);
    }

    #[test]
    fn effects_elsewhere_are_not_judged_by_repeats() {
        let others = |count: usize| [&[4.0, 0.0, 0.1][..], &vec![1.0; count]].concat();
        assert!(p_value_of(&others(2), 3) > OUTSIDE_95, "the repeats hold more than a half");
        assert_eq!(p_value_of(&others(3), 3), 0.0);
    }

    #[test]
    fn what_each_initial_state_explains_is_no_effect() {
        let record = SystemRecord { times: vec![0.0, 1.0], inputs: input(), ..SystemRecord::default() };
        let repeats = Repeats::find(&vec![record; 4]);
        // Each repeat is fully explained, but by a change at another sample.
        let own = |i: usize| {
            let change: Vec<f64> = (0..4).map(|k| if k == i { 1.0 } else { 0.0 }).collect();
            Change { residuals: change.clone(), change }
        };
        assert_eq!(p_value(&repeats, &[0, 1, 2, 3].map(own)), 1.0);
    }
}
