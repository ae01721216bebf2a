//! Divides sample intervals into parts with one cubic per input, and each part into equal steps.

use super::Record;
use crate::model::{Hold, Model};

/// A part of a sample interval in which every input is one cubic.
#[derive(Debug, Clone, Default)]
pub(crate) struct SchedulePiece {
    pub(crate) begin: f64,
    pub(crate) end: f64,
    pub(crate) steps: usize,
    /// Coefficients of the cubic of each input, in powers of the time since `begin`.
    pub(crate) inputs: Vec<[f64; 4]>,
    /// Indices of inputs with zero-order hold and a delay whose value changes at `begin`.
    pub(crate) jumps: Vec<usize>,
}

/// Divides the interval from sample `index` of a record to the next into pieces.
///
/// The pieces have `substeps` steps in all, or more if an input changes its cubic within the interval.
pub(crate) fn pieces(
    model: &Model,
    record: &Record,
    parameters: &[f64],
    index: usize,
    substeps: usize,
) -> Vec<SchedulePiece> {
    let (begin, end) = (record.times[index], record.times[index + 1]);
    let delay = |input: usize| model.inputs[input].delay.map_or(0.0, |d| parameters[d]);
    let mut cuts = vec![begin];
    let mut jumps: Vec<(f64, usize)> = Vec::new();
    for (input, signal) in record.inputs.iter().enumerate() {
        let delay = delay(input);
        let knots = signal.knots();
        let from = knots.partition_point(|knot| knot + delay < begin);
        for knot in knots[from..].iter().map(|knot| knot + delay).take_while(|knot| *knot < end) {
            if knot > begin {
                cuts.push(knot);
            }
            if signal.hold() == Hold::Zero && model.inputs[input].delay.is_some() {
                jumps.push((knot, input));
            }
        }
    }
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    cuts.push(end);
    let part = |pair: &[f64]| {
        let (from, to) = (pair[0], pair[1]);
        let share = (to - from) / (end - begin) * substeps as f64;
        // A share that exceeds a whole number only by rounding gets no additional step.
        let steps = (share - 1e-9).ceil().max(1.0) as usize;
        let input = |(input, signal): (usize, &super::Signal)| {
            let delay = delay(input);
            signal.coefficients_around(0.5 * (from + to) - delay, from - delay)
        };
        SchedulePiece {
            begin: from,
            end: to,
            steps,
            inputs: record.inputs.iter().enumerate().map(input).collect(),
            jumps: jumps.iter().filter(|(at, _)| *at == from).map(|(_, input)| *input).collect(),
        }
    };
    cuts.windows(2).map(part).collect()
}
