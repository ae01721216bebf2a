//! Free runs: simulations of whole recordings from their first samples.
//!
//! Fits divide long recordings into windows with their own initial states. An effect that helps over windows
//! may make a free run diverge, and only free runs show that.

use crate::fit::{ChosenRecords, Fit, fit_nuisance};
use crate::forecast::{beginning, predictor, simulate_from};
use crate::record::{Measured, Record};
use crate::records::parts::{as_single_window, known_samples};
use augsim_system::shortest_difference;
use rayon::prelude::*;
use std::ops::Range;

/// Maximum number of samples in all free runs together; more add cost, not information.
const MAX_SAMPLES: usize = 30_000;

/// Recordings that are simulated as a whole, with the samples on which the errors are compared.
#[derive(Clone, Debug)]
pub(crate) struct FreeRuns {
    runs: Vec<Run>,
    correlation: f64,
}

#[derive(Clone, Debug)]
struct Run {
    /// First samples of the recording, to which the initial state is fitted.
    beginning: Measured,
    /// The whole recording, with weight 0 for samples whose errors do not count.
    judged: Record,
}

impl FreeRuns {
    /// Collects the recordings that contain the held-out records, on which the errors are compared. `None`
    /// where no fit divides a recording into windows.
    pub fn new(heldout: &ChosenRecords<'_>) -> Option<Self> {
        let data = heldout.data;
        let mut runs: Vec<Run> = data
            .recordings
            .iter()
            .enumerate()
            .filter_map(|(index, recording)| {
                let everything = |_: usize| true;
                let first = known_samples(&recording.whole.data, recording.whole.data.times.len());
                let mut start = as_single_window(data, index, everything);
                start.data.initial_sample_count = first;
                let mut judged = as_single_window(data, index, |j| heldout.chosen.contains(&j));
                judged.weight.iter_mut().for_each(|w| w[..first].fill(0.0));
                let has_samples = judged.weight.iter().flatten().any(|w| *w > 0.0);
                has_samples.then(|| Run { beginning: data.with_records(vec![beginning(&start)]), judged })
            })
            .collect();
        let samples: usize = runs.iter().map(|run| run.judged.data.times.len()).sum();
        let stride = samples.div_ceil(MAX_SAMPLES).max(1);
        runs = runs.into_iter().step_by(stride).collect();
        (!runs.is_empty()).then_some(Self { runs, correlation: heldout.correlation })
    }

    /// Sum of squared errors and number of samples, `[segment][channel]`, for each held-out segment of the
    /// recordings.
    pub fn squares(&self, fit: &Fit) -> Vec<Vec<(f64, f64)>> {
        let h = predictor(fit);
        let sums_of_run = |run: &Run| {
            let sample = ChosenRecords { data: &run.beginning, chosen: &[0], correlation: self.correlation };
            let start = fit_nuisance(&sample, &h, &fit.theta, &[]);
            let (first, everything) = (&run.beginning.records[0], 0..run.judged.data.times.len());
            let out = simulate_from(first, &run.judged, everything, &h, &fit.theta, &start.nuisance[0]);
            let in_channel = |c: usize, stretch: &Range<usize>| {
                let counted = stretch.clone().filter(|&k| run.judged.weight[c][k] > 0.0);
                let period = h.system.schema().channels[c].period;
                counted.fold((0.0, 0.0), |(sum, count), k| {
                    let error = shortest_difference(run.judged.data.values[c][k] - out.value(k, c), period);
                    (sum + error.powi(2), count + 1.0)
                })
            };
            let of_stretch = |s: &Range<usize>| (0..out.channels()).map(|c| in_channel(c, s)).collect();
            stretches(&run.judged).iter().map(of_stretch).collect::<Vec<Vec<_>>>()
        };
        self.runs.par_iter().map(sums_of_run).collect::<Vec<_>>().concat()
    }
}

/// Ranges of consecutive samples that have weight in any channel.
fn stretches(record: &Record) -> Vec<Range<usize>> {
    let has_weight = |k: usize| record.weight.iter().any(|w| w[k] > 0.0);
    let mut found: Vec<Range<usize>> = Vec::new();
    for k in (0..record.data.times.len()).filter(|k| has_weight(*k)) {
        match found.last_mut() {
            Some(last) if last.end == k => last.end = k + 1,
            _ => found.push(k..k + 1),
        }
    }
    found
}

/// Geometric mean over channels of the root mean square errors; infinite where one is not finite. `sums`
/// holds the sum of squared errors and the number of samples of each channel.
pub(crate) fn mean_error(sums: &[(f64, f64)]) -> f64 {
    if sums.iter().any(|(sum, _)| !sum.is_finite()) {
        return f64::INFINITY;
    }
    let error =
        |(sum, count): &(f64, f64)| (*count > 0.0).then(|| (sum / count).sqrt().max(f64::MIN_POSITIVE).ln());
    let logs: Vec<f64> = sums.iter().filter_map(error).collect();
    let mean = (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp();
    if mean.is_finite() { mean } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    //! Contract: all channels count relatively, and a diverging run has an infinite error.
    use super::*;

    #[test]
    fn the_error_is_a_geometric_mean_over_channels() {
        let error = mean_error(&[(16.0, 4.0), (32.0, 1.0 / 2.0), (0.0, 0.0)]);
        assert!((error - 4.0).abs() < 1e-12, "{error}");
    }

    #[test]
    fn a_diverging_run_has_an_infinite_error() {
        for wild in [f64::NAN, f64::INFINITY] {
            assert_eq!(mean_error(&[(4.0, 4.0), (wild, 4.0)]), f64::INFINITY);
        }
    }
}
