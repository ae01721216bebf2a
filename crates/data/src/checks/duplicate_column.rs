//! Check for one signal in two columns.
//!
//! Two sensors of one quantity differ by their calibration, even if they have little noise. Equal columns are
//! therefore one signal where their resolution is finer than that difference, or where many changes were
//! rounded equally:
//!
//! 1. Two readings that differ by d are rounded to the same multiple of q with probability p = 1 - d/q.
//! 2. The columns are one signal where p^n is below `exp(MAX_LOG_PROBABILITY)` for n changes.

use super::{ExpectedData, Finding};
use crate::dataset::Dataset;

/// Smallest difference of two sensors of one quantity, relative to the span of the column (d in formula 1).
///
/// The best industrial instruments agree to 5e-4.
const MIN_DIFFERENCE: f64 = 1e-4;
/// Log probability of agreement by chance below which two equal columns count as one signal.
///
/// The value is the same as in `repeated_trajectory`.
const MAX_LOG_PROBABILITY: f64 = -20.7;
/// Lower bound of the probability that two sensors round one change equally (p in formula 1).
///
/// With it, at least five equal changes are needed.
const MIN_AGREEMENT: f64 = 0.01;
/// Maximum difference of two values, relative to the span, that rounding errors of arithmetic explain.
const ROUNDING_ERROR: f64 = 1e-9;

/// Role in which a model reads a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Output,
    Input,
}

/// Finds pairs of equal columns among those that the model reads, or among all columns without a model.
pub(super) fn run(data: &Dataset, expected: &ExpectedData) -> Vec<Finding> {
    let has_no_model = expected.outputs.is_empty() && expected.inputs.is_empty();
    let role = |name: &str| match () {
        () if expected.outputs.iter().any(|o| o == name) => Some(Role::Output),
        () if expected.inputs.iter().any(|i| i == name) => Some(Role::Input),
        () => None,
    };
    let columns = data.columns().iter().enumerate();
    let compared: Vec<(usize, &str, Option<Role>)> = columns
        .map(|(i, c)| (i, c.name(), role(c.name())))
        .filter(|(.., role)| has_no_model || role.is_some())
        .collect();
    let mut findings = Vec::new();
    for (place, one) in compared.iter().enumerate() {
        for other in &compared[place + 1..] {
            let Some(samples) = equal_samples(data, one.0, other.0) else { continue };
            let columns = [one, other].map(|c| c.1.to_owned());
            findings.push(match [one.2, other.2] {
                [Some(Role::Output), Some(Role::Output)] => Finding::DuplicateOutput { columns, samples },
                [Some(Role::Input), Some(Role::Input)] => Finding::DuplicateInput { columns, samples },
                [Some(Role::Input), Some(_)] => {
                    let [input, output] = columns;
                    Finding::InputEqualsOutput { input, output, samples }
                }
                [Some(Role::Output), Some(_)] => {
                    let [output, input] = columns;
                    Finding::InputEqualsOutput { input, output, samples }
                }
                _ => Finding::DuplicateColumn { columns, samples },
            });
        }
    }
    findings
}

/// Number of samples at which both columns have a value; `None` unless all agree and not by chance.
fn equal_samples(data: &Dataset, one: usize, other: usize) -> Option<usize> {
    let (mut values, mut changes) = (Vec::new(), 0);
    for t in data.trajectories() {
        let mut last = None;
        for (x, y) in
            t.column(one).iter().zip(t.column(other)).filter(|(x, y)| x.is_finite() && y.is_finite())
        {
            if x != y {
                return None;
            }
            // A value that is repeated from sample to sample is no further evidence, nor is one that is
            // constant.
            changes += usize::from(last.is_some_and(|last| last != *x));
            last = Some(*x);
            values.push(*x);
        }
    }
    let samples = values.len();
    let (span, resolution) = span_and_resolution(values)?;
    // Formula (1) of the file head.
    let agreement = (1.0 - MIN_DIFFERENCE * span / resolution).max(MIN_AGREEMENT);
    (changes as f64 * agreement.ln() < MAX_LOG_PROBABILITY).then_some(samples)
}

/// Span of the values and their resolution (smallest difference of two values); `None` if all are equal.
fn span_and_resolution(mut values: Vec<f64>) -> Option<(f64, f64)> {
    values.sort_unstable_by(f64::total_cmp);
    let span = values.last()? - values.first()?;
    let gaps = values.windows(2).map(|w| w[1] - w[0]).filter(|gap| *gap > ROUNDING_ERROR * span);
    gaps.min_by(f64::total_cmp).map(|resolution| (span, resolution))
}
