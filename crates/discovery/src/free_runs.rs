//! Free runs of whole recordings: what a model foretells of held-out stretches from the first samples of a recording alone.
//!
//! Fits see long recordings in windows, each with a start of its own. A term that helps over windows may drive a run away that is
//! never put right by data; a forecast is such a run.

use crate::blocks::known;
use crate::fit::{ChosenRecords, Fit, fit, fit_nuisance};
use crate::forecast::{beginning, foretold, predictor};
use crate::record::{Measured, Record};
use augsim_physics::system::Window;
use rayon::prelude::*;

/// Ratio of two free runs' errors up to which neither is worse: a difference that no forecast would notice.
pub(crate) const NO_WORSE: f64 = 1.01;

/// Samples that free runs are compared on: more cost time and change little.
const MOST_SAMPLES: usize = 30_000;

/// Recordings with the samples on which free runs are compared.
#[derive(Clone, Debug)]
pub(crate) struct FreeRuns {
    runs: Vec<Run>,
    correlation: f64,
}

#[derive(Clone, Debug)]
struct Run {
    /// The first samples of the recording, alone.
    beginning: Measured,
    /// The recording; samples that do not count have no weight.
    judged: Record,
}

impl FreeRuns {
    /// Free runs of the recordings that the records of `heldout` are parts of, compared on these parts; `None` where fits see no
    /// recording in several windows.
    pub fn new(heldout: &ChosenRecords<'_>) -> Option<Self> {
        let data = heldout.data;
        let mut runs: Vec<Run> = data
            .recordings
            .iter()
            .enumerate()
            .filter_map(|(index, recording)| {
                let everything = |_: usize| true;
                let first = known(&recording.whole.seen, recording.whole.seen.times.len());
                let mut start = whole(data, index, everything);
                start.seen.known = first;
                let mut judged = whole(data, index, |j| heldout.chosen.contains(&j));
                judged.weight.iter_mut().for_each(|w| w[..first].fill(0.0));
                let any = judged.weight.iter().flatten().any(|w| *w > 0.0);
                any.then(|| Run { beginning: data.with_records(vec![beginning(&start)]), judged })
            })
            .collect();
        let samples: usize = runs.iter().map(|run| run.judged.seen.times.len()).sum();
        let stride = samples.div_ceil(MOST_SAMPLES).max(1);
        runs = runs.into_iter().step_by(stride).collect();
        (!runs.is_empty()).then_some(Self { runs, correlation: heldout.correlation })
    }

    /// Error of a fit's free runs: the geometric mean over channels of their root mean square errors, infinite where a run does
    /// not stay finite.
    pub fn error(&self, fit: &Fit) -> f64 {
        let h = predictor(fit);
        let sums: Vec<Vec<(f64, f64)>> = self
            .runs
            .par_iter()
            .map(|run| {
                let sample =
                    ChosenRecords { data: &run.beginning, chosen: &[0], correlation: self.correlation };
                let start = fit_nuisance(&sample, &h, &fit.theta, &[]);
                let (first, everything) = (&run.beginning.records[0], 0..run.judged.seen.times.len());
                let out = foretold(first, &run.judged, everything, &h, &fit.theta, &start.nuisance[0]);
                let squares = |c: usize| {
                    let counted = run.judged.weight[c].iter().enumerate().filter(|(_, w)| **w > 0.0);
                    counted.fold((0.0, 0.0), |(sum, count), (k, _)| {
                        (sum + (run.judged.seen.values[c][k] - out.value(k, c)).powi(2), count + 1.0)
                    })
                };
                (0..out.channels()).map(squares).collect()
            })
            .collect();
        let channels = sums.first().map_or(0, Vec::len);
        let error = |c: usize| {
            let (sum, count) = sums.iter().fold((0.0, 0.0), |a, s| (a.0 + s[c].0, a.1 + s[c].1));
            (count > 0.0).then(|| (sum / count).sqrt().max(f64::MIN_POSITIVE).ln())
        };
        let logs: Vec<f64> = (0..channels).filter_map(error).collect();
        let mean = (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp();
        if mean.is_finite() { mean } else { f64::INFINITY }
    }
}

/// A recording as one record of one window, with the weights of those of its parts that are `wanted` and none elsewhere.
fn whole(data: &Measured, index: usize, wanted: impl Fn(usize) -> bool) -> Record {
    let recording = &data.recordings[index];
    let mut record = recording.whole.clone();
    let samples = record.seen.times.len();
    record.weight = vec![vec![0.0; samples]; record.seen.values.len()];
    for &(part, first) in recording.parts.iter().filter(|(part, _)| wanted(*part)) {
        for (to, from) in record.weight.iter_mut().zip(&data.records[part].weight) {
            to[first..first + from.len()].copy_from_slice(from);
        }
    }
    let start = record.seen.windows.first().map_or_else(Vec::new, |w| w.start.clone());
    record.seen.windows = vec![Window { samples: 0..samples, start }];
    record
}

/// The fit `from` of `sample` with parameters that are fitted over whole recordings, to those of their samples that belong to
/// `sample`: what a window forgives over its own start, a recording does not.
pub(crate) fn fit_whole(sample: &ChosenRecords<'_>, from: &Fit) -> Fit {
    let data = sample.data;
    let records = (0..data.recordings.len()).map(|i| whole(data, i, |j| sample.chosen.contains(&j)));
    let records: Vec<Record> = records.filter(|r| r.weight.iter().flatten().any(|w| *w > 0.0)).collect();
    let everything: Vec<usize> = (0..records.len()).collect();
    let long = data.with_records(records);
    let long = ChosenRecords { data: &long, chosen: &everything, correlation: sample.correlation };
    let starts = fit_nuisance(&long, &from.hypothesis, &from.theta, &[]);
    let found = fit(&long, &from.hypothesis, &from.theta, &starts.nuisance);
    fit_nuisance(sample, &found.hypothesis, &found.theta, &from.nuisance)
}
