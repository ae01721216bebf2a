//! One signal in two columns.
//!
//! Two sensors of one quantity differ by their calibration, however quiet they are. Equal numbers are therefore no chance where
//! they are finer than that difference, or where many changes were rounded alike.

use super::{Expected, Finding};
use crate::dataset::Dataset;

/// Difference of two sensors of one quantity, as a share of the span: industrial instruments of the best class agree to 5e-4.
const MIN_DIFFERENCE: f64 = 1e-4;
/// Logarithm of the probability that two columns agree by chance, below which they are one; that of `repeated_trajectory`.
const CHANCE: f64 = -20.7;
/// Probability that one change is rounded alike by chance, at the least: so five changes are needed in any case.
const MIN_AGREEMENT: f64 = 0.01;
/// Difference of two values, as a share of the span, that arithmetic makes of one value.
const ARITHMETIC: f64 = 1e-9;

/// Role in which a model reads a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Output,
    Input,
}

/// Every pair of equal columns that the model reads, or of all columns where there is no model.
pub(super) fn look(data: &Dataset, expected: &Expected) -> Vec<Finding> {
    let is_any_role = expected.outputs.is_empty() && expected.inputs.is_empty();
    let role = |name: &str| match () {
        () if expected.outputs.iter().any(|o| o == name) => Some(Role::Output),
        () if expected.inputs.iter().any(|i| i == name) => Some(Role::Input),
        () => None,
    };
    let columns = data.columns().iter().enumerate();
    let read: Vec<(usize, &str, Option<Role>)> = columns
        .map(|(i, c)| (i, c.name(), role(c.name())))
        .filter(|(.., role)| is_any_role || role.is_some())
        .collect();
    let mut findings = Vec::new();
    for (place, one) in read.iter().enumerate() {
        for other in &read[place + 1..] {
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

/// Samples with values of both columns, where all of these are equal and this is no chance.
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
            // What is held proves nothing more, nor does a value that describes a whole trajectory.
            changes += usize::from(last.is_some_and(|last| last != *x));
            last = Some(*x);
            values.push(*x);
        }
    }
    let samples = values.len();
    let (span, resolution) = span_and_resolution(values)?;
    // Two readings that differ by d are rounded to steps of q alike with probability 1 - d/q.
    let agreement = (1.0 - MIN_DIFFERENCE * span / resolution).max(MIN_AGREEMENT);
    (changes as f64 * agreement.ln() < CHANCE).then_some(samples)
}

/// Largest less smallest value, and the smallest difference of two values: the rounding, or more where values are few. `None` for a
/// constant.
fn span_and_resolution(mut values: Vec<f64>) -> Option<(f64, f64)> {
    values.sort_unstable_by(f64::total_cmp);
    let span = values.last()? - values.first()?;
    let gaps = values.windows(2).map(|w| w[1] - w[0]).filter(|gap| *gap > ARITHMETIC * span);
    gaps.min_by(f64::total_cmp).map(|resolution| (span, resolution))
}
