//! Scatter between repeats: recordings of one group with the same inputs, whose differences no model predicts from these
//! inputs.
//!
//! Repeats may begin in different states. So not their readings are compared but the errors `e_i(t)` of a model that
//! knows the beginning of each repeat `i`. The mean over the `n` repeats of a set is what the model lacks in all of them;
//! the differences from it are the scatter, with `n - 1` degrees of freedom at each time (lack of fit and pure error:
//! Draper and Smith 1998, Applied Regression Analysis, section 2.1). Both are averaged over time and sets:
//!
//! ```text
//! scatter^2 = sum_sets sum_t sum_i (e_i(t) - mean_i e_i(t))^2 / sum_sets sum_t (n - 1)
//! common^2  = sum_sets sum_t sum_i (mean_i e_i(t))^2 / sum_sets sum_t n  -  scatter^2 sum_sets sum_t 1 / sum_sets sum_t n
//! ```

use augsim_system::{Record, Stream};
use serde::{Deserialize, Serialize};

/// Largest difference between the inputs of repeats (root mean square), as a share of the input's standard deviation.
/// In a linear system it changes the outputs by as small a share of theirs.
const MAX_INPUT_DIFFERENCE: f64 = 0.01;
/// Minimum number of recordings of a set of repeats. The scatter of two has one degree of freedom, and says little.
const MIN_REPEATS: usize = 3;

/// Scatter of an output between recordings with the same inputs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RepeatScatter {
    /// Name of the output.
    pub output: String,
    /// Standard deviation of the model's errors between repeats at the same time, in the unit of the output.
    pub sd: f64,
    /// Estimated part of the model's errors that all repeats of a set have in common (root mean square), in the unit of
    /// the output; 0 if it is not larger than the scatter of the mean.
    #[serde(default)]
    pub common: f64,
    /// Unit of the output; empty for a pure number.
    pub unit: String,
    /// Number of recordings that repeat others.
    pub recordings: usize,
    /// Number of sets of recordings with the same inputs.
    pub sets: usize,
}

/// Recordings that repeat each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Repeats {
    /// Indices of the recordings of each set with the same inputs.
    sets: Vec<Vec<usize>>,
}

impl Repeats {
    /// Finds the recordings of one group that have the same values of all inputs and covariates. Recordings without
    /// inputs repeat nothing, nor do fewer than three with the same ones.
    pub fn find(records: &[Record]) -> Self {
        let tolerances = tolerances(records);
        let mut sets: Vec<Vec<usize>> = Vec::new();
        for (index, record) in records.iter().enumerate().filter(|(_, r)| !r.inputs.is_empty()) {
            let repeats = |set: &&mut Vec<usize>| is_repeat(&records[set[0]], record, &tolerances);
            match sets.iter_mut().find(repeats) {
                Some(set) => set.push(index),
                None => sets.push(vec![index]),
            }
        }
        sets.retain(|set| set.len() >= MIN_REPEATS);
        Self { sets }
    }

    /// Whether no recording repeats others.
    pub fn is_empty(&self) -> bool {
        self.sets.is_empty()
    }

    /// Indices of the recordings of each set with the same inputs.
    pub fn sets(&self) -> impl Iterator<Item = &Vec<usize>> {
        self.sets.iter()
    }

    /// Measures the scatter of a model's errors between repeats. `errors` is `[recording][output][sample]`, NaN where there
    /// is none; `outputs` has the names and units of the outputs. Outputs without errors have no scatter.
    pub fn scatter(&self, errors: &[Vec<Vec<f64>>], outputs: &[(String, String)]) -> Vec<RepeatScatter> {
        let recordings = self.sets.iter().map(Vec::len).sum();
        let of_output = |(index, (output, unit)): (usize, &(String, String))| {
            let [scatter, common] = self.variances(|recording| &errors[recording][index])?;
            Some(RepeatScatter {
                output: output.clone(),
                sd: scatter.sqrt(),
                common: common.sqrt(),
                unit: unit.clone(),
                recordings,
                sets: self.sets.len(),
            })
        };
        outputs.iter().enumerate().filter_map(of_output).collect()
    }

    /// Mean squares of an output's errors between repeats and of what they have in common; `None` without errors.
    fn variances<'e>(&self, errors: impl Fn(usize) -> &'e Vec<f64>) -> Option<[f64; 2]> {
        let (mut within, mut of_means) = (0.0, 0.0);
        let (mut times, mut readings) = (0.0, 0.0);
        for set in &self.sets {
            let samples = set.iter().map(|&recording| errors(recording).len()).min().unwrap_or(0);
            for k in 0..samples {
                let at_time: Vec<f64> = set.iter().map(|&recording| errors(recording)[k]).collect();
                if at_time.iter().all(|error| error.is_finite()) {
                    let count = at_time.len() as f64;
                    let mean = at_time.iter().sum::<f64>() / count;
                    within += at_time.iter().map(|error| (error - mean).powi(2)).sum::<f64>();
                    of_means += count * mean * mean;
                    (times, readings) = (times + 1.0, readings + count);
                }
            }
        }
        if times == 0.0 {
            return None;
        }
        let scatter = within / (readings - times);
        // The squared mean of `n` errors contains their scatter divided by `n`.
        Some([scatter, f64::max((of_means - times * scatter) / readings, 0.0)])
    }
}

/// Largest difference of each input column between repeats, in its unit.
fn tolerances(records: &[Record]) -> Vec<Vec<f64>> {
    let first = records.first().map(|r| &r.inputs[..]).unwrap_or_default();
    let of_column = |input: usize, column: usize| {
        let values = records.iter().flat_map(|r| &r.inputs[input].values[column]).copied();
        MAX_INPUT_DIFFERENCE * standard_deviation(values.filter(|v| v.is_finite()))
    };
    let of_input = |(input, stream): (usize, &Stream)| {
        (0..stream.values.len()).map(|column| of_column(input, column)).collect()
    };
    first.iter().enumerate().map(of_input).collect()
}

/// Standard deviation of values; 0 if there are none.
fn standard_deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = (values.clone().count() as f64).max(1.0);
    let mean = values.clone().sum::<f64>() / count;
    (values.map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt()
}

/// Whether two recordings have the same group, covariates, sample times and inputs, the inputs within these tolerances.
fn is_repeat(one: &Record, other: &Record, tolerances: &[Vec<f64>]) -> bool {
    let same_number = |a: &f64, b: &f64| a == b || a.is_nan() && b.is_nan();
    let [begin, other_begin] = [one, other].map(|r| r.times.first().copied().unwrap_or(0.0));
    let are_equal = |inputs: (&Stream, &Stream), tolerances: &Vec<f64>| {
        let (first, second) = inputs;
        are_simultaneous((&first.times, begin), (&second.times, other_begin))
            && first.values.iter().zip(&second.values).zip(tolerances).all(|((a, b), tolerance)| {
                let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
                // A gap in one of them is a difference.
                (squares.sum::<f64>() / a.len() as f64).sqrt() <= *tolerance
            })
    };
    one.group == other.group
        && one.covariates.iter().zip(&other.covariates).all(|(a, b)| same_number(a, b))
        && are_simultaneous((&one.times, begin), (&other.times, other_begin))
        && one.inputs.iter().zip(&*other.inputs).zip(tolerances).all(|(pair, t)| are_equal(pair, t))
}

/// Whether two lists of times since the beginnings of their recordings, s, agree within half a sample step.
fn are_simultaneous((first, begin): (&[f64], f64), (second, other_begin): (&[f64], f64)) -> bool {
    if first.len() != second.len() || first.len() < 2 {
        return false;
    }
    let step = (first[first.len() - 1] - first[0]) / (first.len() - 1) as f64;
    first.iter().zip(second).all(|(a, b)| ((a - begin) - (b - other_begin)).abs() <= 0.5 * step)
}

#[cfg(test)]
mod tests {
    //! Contract: the differences of a model's errors between recordings with equal inputs are the scatter, and their mean
    //! is common, without its own scatter; recordings of other groups, with other inputs, and two repeats only, have none.
    use super::*;
    use std::sync::Arc;

    /// Recordings of 50 s with the same input; that of the last is larger by the share `change`.
    fn recordings(count: usize, change: f64) -> Vec<Record> {
        let record = |i: usize| {
            let times: Vec<f64> = (0..50).map(f64::from).collect();
            let own_change = if i + 1 == count { change } else { 0.0 };
            let input = times.iter().map(|t| (t / 5.0).sin() * (1.0 + own_change)).collect();
            let stream = Stream { times: times.clone(), values: vec![input] };
            Record { times, inputs: Arc::new([stream]), ..Record::default() }
        };
        (0..count).map(record).collect()
    }

    /// Scatter of errors that are constant in each recording.
    fn of_constants(errors: &[f64]) -> Vec<RepeatScatter> {
        let repeats = Repeats::find(&recordings(errors.len(), 0.0));
        let errors: Vec<_> = errors.iter().map(|error| vec![vec![*error; 50]]).collect();
        repeats.scatter(&errors, &[("y".to_owned(), "m".to_owned())])
    }

    fn sizes(repeats: &Repeats) -> Vec<usize> {
        repeats.sets.iter().map(Vec::len).collect()
    }

    #[test]
    fn errors_scatter_about_what_they_have_in_common() {
        let found = of_constants(&[0.4, 0.5, 0.6]);
        assert!((found[0].sd - 0.1).abs() < 1e-12, "{found:?}");
        // The square of the mean of three errors contains a third of the variance.
        assert!((found[0].common.powi(2) - (0.25 - 0.01 / 3.0)).abs() < 1e-12, "{found:?}");
        assert_eq!(
            (&*found[0].output, &*found[0].unit, found[0].recordings, found[0].sets),
            ("y", "m", 3, 1)
        );
        assert_eq!(of_constants(&[-0.1, 0.0, 0.1])[0].common, 0.0);
        assert_eq!(of_constants(&[0.4, f64::NAN, 0.6]), []);
        assert_eq!(of_constants(&[0.4, 0.6]), []);
    }

    #[test]
    fn recordings_with_other_inputs_are_no_repeats() {
        // Half of the tolerance is the same input, twice the tolerance is another.
        assert_eq!(sizes(&Repeats::find(&recordings(4, 0.005))), [4]);
        assert_eq!(sizes(&Repeats::find(&recordings(4, 0.02))), [3]);
        let mut others = recordings(4, 0.0);
        others[0].group = 1;
        assert_eq!(sizes(&Repeats::find(&others)), [3]);
        others[1].covariates = vec![2.0];
        others[2..].iter_mut().for_each(|record| record.covariates = vec![1.0]);
        assert!(Repeats::find(&others).is_empty());
        let mut free = recordings(4, 0.0);
        free.iter_mut().for_each(|record| record.inputs = Arc::new([]));
        assert!(Repeats::find(&free).is_empty());
    }
}
