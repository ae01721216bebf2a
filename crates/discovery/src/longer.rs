//! Parameters from windows that are longer than those of the search, up to whole recordings.
//!
//! Noise of the motion, or a law that is still missing, makes the misfit grow with the length of windows, and estimates hang on
//! that length: over short windows what is fast decides, over a whole recording its slowest drift. Each length is tried, and a
//! longer one is taken where all parts of the data, each left out in turn, are foretold better by it.

use crate::blocks::block;
use crate::cut::Clock;
use crate::fit::{ChosenRecords, Fit, fit, fit_nuisance};
use crate::folded::LeftOut;
use crate::free_runs::{NO_WORSE, weighted};
use crate::record::{Measured, Record};
use augsim_physics::system::Window;
use rayon::prelude::*;

/// Windows that join so many of the search's, with the errors of free runs in all stretches, each by a fit over such windows that did
/// not see it.
#[derive(Clone, Debug)]
pub(crate) struct Length {
    pub joined: usize,
    pub errors: Vec<f64>,
}

/// Lengths up to whole recordings with the errors of the hypothesis of `from`, fitted from its values to what each part leaves. Where
/// a doubling changes no forecast, as under noise of the sensor alone, windows are long enough, and none longer is tried; nor where
/// the time is over.
pub(crate) fn lengthened(
    sample: &ChosenRecords<'_>,
    parts: &[LeftOut],
    from: &Fit,
    clock: &Clock,
) -> Vec<Length> {
    let mut found: Vec<Length> = Vec::new();
    for joined in std::iter::once(1).chain(lengths(sample.data)) {
        if !found.is_empty() && clock.is_over() {
            break;
        }
        let Some(length) = at_length(sample, parts, from, joined) else { break };
        let is_settled = found.last().is_some_and(|last| runs_alike(&length.errors, &last.errors));
        found.push(length);
        if is_settled {
            break;
        }
    }
    found
}

/// Windows that join so many of the search's, with the errors of a hypothesis that is fitted to what each part leaves, from the values
/// of `from`; `None` where a fit is lost.
pub(crate) fn at_length(
    sample: &ChosenRecords<'_>,
    parts: &[LeftOut],
    from: &Fit,
    joined: usize,
) -> Option<Length> {
    let errors = |part: &LeftOut| {
        let rest = part.rest(sample);
        let begun = fit_nuisance(&rest, &from.hypothesis, &from.theta, &[]);
        let found = match joined {
            1 => fit(&rest, &begun.hypothesis, &begun.theta, &begun.nuisance),
            _ => fit_joined(&rest, &begun, joined),
        };
        found.theta.iter().all(|v| v.is_finite()).then(|| part.runs.errors(&found))
    };
    let errors: Option<Vec<Vec<f64>>> = parts.par_iter().map(errors).collect();
    errors.map(|errors| Length { joined, errors: errors.concat() })
}

/// How many of the search's windows each window of the best length joins: one part's estimates may err by more than lengths differ.
pub(crate) fn best_joined(lengths: &[Length]) -> usize {
    lengths.get(best(lengths)).map_or(1, |length| length.joined)
}

/// The error of a set's free runs over that of another's, each at its best length.
pub(crate) fn ratio_at_best(set: &[Length], other: &[Length]) -> f64 {
    let [set, other] = [set, other].map(|lengths| root_of_sum(&lengths[best(lengths)].errors));
    set / other
}

/// The number of the best of several lengths, the shortest first, by the errors of each.
fn best(lengths: &[Length]) -> usize {
    let is_better = |n: usize, than: usize| run_better(&lengths[n].errors, &lengths[than].errors);
    (1..lengths.len()).fold(0, |best, n| if is_better(n, best) { n } else { best })
}

/// Whether free runs are better than others, by the errors of each in every held-out stretch, by more than no forecast would
/// notice. Stretches of one recording lean on one another: in how many of them a run is better says less than how much.
fn run_better(errors: &[f64], others: &[f64]) -> bool {
    NO_WORSE * root_of_sum(errors) < root_of_sum(others)
}

fn root_of_sum(errors: &[f64]) -> f64 {
    errors.iter().map(|e| e * e).sum::<f64>().sqrt()
}

/// Whether neither of two runs is better, by the errors of each in every held-out stretch.
fn runs_alike(errors: &[f64], others: &[f64]) -> bool {
    !run_better(errors, others) && !run_better(others, errors)
}

/// How many windows of the search one longer window consists of: doublings, and last as many as the longest recording has.
fn lengths(data: &Measured) -> Vec<usize> {
    let most = data.recordings.iter().map(|r| r.whole.seen.windows.len()).max().unwrap_or(0);
    let doublings = std::iter::successors(Some(2), |joined: &usize| joined.checked_mul(2));
    let mut lengths: Vec<usize> = doublings.take_while(|joined| *joined < most).collect();
    lengths.extend((most > 1).then_some(most));
    lengths
}

/// The fit `from` of `sample` with parameters that are fitted over windows of which each joins so many of the search, to those of
/// their samples that belong to `sample`: what a window forgives over its own start, a longer one does not.
pub(crate) fn fit_joined(sample: &ChosenRecords<'_>, from: &Fit, joined: usize) -> Fit {
    let (long, everything) = joined_windows(sample, joined);
    let long = ChosenRecords { data: &long, chosen: &everything, correlation: sample.correlation };
    let found = fit_anew(&long, from);
    fit_nuisance(sample, &found.hypothesis, &found.theta, &from.nuisance)
}

/// [`fit_joined`] over windows that grow to those that join so many, each length from where the one before it ended.
pub(crate) fn fit_up_to(sample: &ChosenRecords<'_>, from: Fit, joined: usize) -> Fit {
    let lengths = lengths(sample.data).into_iter().take_while(|length| *length <= joined);
    lengths.fold(from, |fit, length| fit_joined(sample, &fit, length))
}

/// The fit `from` of other windows, from starts that are found anew at its parameters.
pub(crate) fn fit_anew(sample: &ChosenRecords<'_>, from: &Fit) -> Fit {
    let starts = fit_nuisance(sample, &from.hypothesis, &from.theta, &[]);
    fit(sample, &from.hypothesis, &from.theta, &starts.nuisance)
}

/// The recordings of a sample in windows of which each joins so many of the search, and the numbers of all these records: samples
/// that are not of the sample have no weight.
pub(crate) fn joined_windows(sample: &ChosenRecords<'_>, joined: usize) -> (Measured, Vec<usize>) {
    let data = sample.data;
    let of = |index: usize| windows_joined(&weighted(data, index, |j| sample.chosen.contains(&j)), joined);
    let records: Vec<Record> = (0..data.recordings.len()).flat_map(of).collect();
    let everything = (0..records.len()).collect();
    (data.with_records(records), everything)
}

/// The parts of a recording that join so many windows each, as records of one window; parts of which no sample counts are
/// left out.
fn windows_joined(whole: &Record, joined: usize) -> Vec<Record> {
    let windows = whole.seen.windows.len();
    let parts = windows.div_ceil(joined.max(1));
    let part = |p: usize| {
        let mut part = block(whole, p * windows / parts..(p + 1) * windows / parts);
        let start = part.seen.windows.first().map_or_else(Vec::new, |w| w.start.clone());
        part.seen.windows = vec![Window { samples: 0..part.seen.times.len(), start }];
        part
    };
    let counts = |part: &Record| part.weight.iter().flatten().any(|w| *w > 0.0);
    (0..parts).map(part).filter(counts).collect()
}

#[cfg(test)]
mod tests {
    //! Contract: joined windows hold every sample of a recording once, with its weight; each begins where the first of its
    //! windows does, and where nothing counts there is none.
    use super::*;
    use augsim_physics::system::Record as Seen;

    fn recording(windows: usize, each: usize) -> Record {
        let samples = windows * each;
        let window = |w: usize| Window { samples: w * each..(w + 1) * each, start: vec![w as f64] };
        Record {
            seen: Seen {
                times: (0..samples).map(|k| k as f64).collect(),
                values: vec![(0..samples).map(|k| k as f64).collect()],
                windows: (0..windows).map(window).collect(),
                ..Seen::default()
            },
            weight: vec![vec![1.0; samples]],
            tolerated: false,
        }
    }

    #[test]
    fn joined_windows_hold_every_sample_once_and_begin_as_their_first() {
        for (joined, starts) in [(2, vec![0.0, 1.0, 3.0]), (5, vec![0.0]), (usize::MAX, vec![0.0])] {
            let parts = windows_joined(&recording(5, 10), joined);
            let samples: Vec<f64> = parts.iter().flat_map(|p| p.seen.values[0].clone()).collect();
            assert_eq!(samples, (0..50).map(f64::from).collect::<Vec<_>>());
            assert_eq!(parts.iter().map(|p| p.seen.windows[0].start[0]).collect::<Vec<_>>(), starts);
            assert!(parts.iter().all(|p| p.seen.windows.len() == 1));
        }
    }

    #[test]
    fn longer_windows_have_to_run_better_by_what_a_forecast_notices() {
        let now = [1.0, 1.0, 1.0, 4.0];
        assert!(run_better(&[1.0, 1.0, 1.0, 3.9], &now));
        assert!(!run_better(&[0.99, 0.99, 0.99, 4.0], &now) && !run_better(&now, &now));
        assert!(!run_better(&[f64::INFINITY; 4], &now));
        assert!(runs_alike(&[1.005; 4], &[1.0; 4]) && !runs_alike(&[1.02; 4], &[1.0; 4]));
        assert!(!runs_alike(&[1.0; 4], &[1.02; 4]) && !runs_alike(&[f64::INFINITY; 4], &now));
    }

    #[test]
    fn all_stretches_choose_the_length() {
        let joined = |each: &[[f64; 2]]| {
            let length = |(n, e): (usize, &[f64; 2])| Length { joined: 1 << n, errors: e.to_vec() };
            best_joined(&each.iter().enumerate().map(length).collect::<Vec<_>>())
        };
        assert_eq!(joined(&[[2.0, 2.0], [1.0, 1.0]]), 2);
        assert_eq!(joined(&[[2.0, 1.0], [1.0, 2.0]]), 1, "the parts disagree");
        assert_eq!(joined(&[[2.0, 2.0]]), 1, "no longer one could be fitted");
    }

    #[test]
    fn a_part_in_which_no_sample_counts_is_left_out() {
        let mut held_out = recording(4, 10);
        held_out.weight[0][..20].fill(0.0);
        let parts = windows_joined(&held_out, 2);
        assert_eq!(parts.iter().map(|p| p.seen.values[0][0]).collect::<Vec<_>>(), [20.0]);
    }
}
