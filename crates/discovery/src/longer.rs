//! Parameters from windows that are longer than those of the search, up to whole recordings.
//!
//! Noise of the motion, or a law that is still missing, makes the misfit grow with the length of windows, and estimates hang on
//! that length: over short windows what is fast decides, over a whole recording its slowest drift. Each length is tried, and a
//! longer one is taken where each part of the data foretells the other better by it.

use crate::blocks::block;
use crate::fit::{ChosenRecords, Fit, fit, fit_nuisance};
use crate::free_runs::{FreeRuns, NO_WORSE, weighted};
use crate::record::{Measured, Record};
use augsim_physics::system::Window;

/// A fit over windows that join so many of the search's, with the errors of its free runs in each held-out stretch.
#[derive(Debug)]
pub(crate) struct Length {
    pub joined: usize,
    pub fit: Fit,
    pub errors: Vec<f64>,
}

/// The fit `from` of `sample`, and fits over ever longer windows up to whole recordings. Short windows forgive a wrong parameter:
/// each length begins at what the one before it came to. Where a doubling changes no forecast, as under noise of the sensor alone,
/// windows are long enough, and none longer is tried.
pub(crate) fn lengthened(sample: &ChosenRecords<'_>, from: Fit, runs: &FreeRuns) -> Vec<Length> {
    let mut found = vec![Length { joined: 1, errors: runs.errors(&from), fit: from }];
    for joined in lengths(sample.data) {
        let Some(last) = found.last() else { break };
        let fit = fit_joined(sample, &last.fit, joined);
        if !fit.theta.iter().all(|v| v.is_finite()) {
            break;
        }
        let errors = runs.errors(&fit);
        let is_settled = runs_alike(&errors, &last.errors);
        found.push(Length { joined, errors, fit });
        if is_settled {
            break;
        }
    }
    found
}

/// The number of the best of several lengths, the shortest first, by the errors of each in the stretches that either part of the
/// data holds out from the other: one part's estimates may err by more than lengths differ.
pub(crate) fn best_length(parts: &[Vec<Length>; 2]) -> usize {
    best(&errors(parts))
}

/// The error of a set's free runs over that of another's, each at its best length.
pub(crate) fn ratio_at_best(set: &[Vec<Length>; 2], other: &[Vec<Length>; 2]) -> f64 {
    let [set, other] = [set, other].map(|parts| {
        let errors = errors(parts);
        root_of_sum(&errors[best(&errors)])
    });
    set / other
}

/// The errors in all stretches that either part of the data holds out, of each length that both could be fitted over.
fn errors(parts: &[Vec<Length>; 2]) -> Vec<Vec<f64>> {
    let [forth, back] = parts;
    forth.iter().zip(back).map(|(forth, back)| [&*forth.errors, &*back.errors].concat()).collect()
}

/// The number of the best of several lengths, the shortest first, by the errors of each.
fn best(errors: &[Vec<f64>]) -> usize {
    (1..errors.len()).fold(0, |best, n| if run_better(&errors[n], &errors[best]) { n } else { best })
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
        let errors = |each: &[[f64; 2]]| each.iter().map(|e| e.to_vec()).collect::<Vec<_>>();
        assert_eq!(best(&errors(&[[2.0, 2.0], [1.0, 1.0]])), 1);
        assert_eq!(best(&errors(&[[2.0, 1.0], [1.0, 2.0]])), 0, "the parts disagree");
        assert_eq!(best(&errors(&[[2.0, 2.0]])), 0, "one part could not be fitted over more");
    }

    #[test]
    fn a_part_in_which_no_sample_counts_is_left_out() {
        let mut held_out = recording(4, 10);
        held_out.weight[0][..20].fill(0.0);
        let parts = windows_joined(&held_out, 2);
        assert_eq!(parts.iter().map(|p| p.seen.values[0][0]).collect::<Vec<_>>(), [20.0]);
    }
}
