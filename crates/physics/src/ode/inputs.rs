//! Interpolation of recorded inputs between their samples.

use crate::Scalar;
use augsim_system::{InputInterpolation, Record, Schema};

/// Inputs of a record, each on the interval between two of its samples that contains the current time.
#[derive(Clone, Debug)]
pub(super) struct Inputs<'a> {
    schema: &'a Schema,
    record: &'a Record,
    /// Index of the sample at which each input's current interval begins; `None` before the first sample.
    pieces: Vec<Option<usize>>,
}

impl<'a> Inputs<'a> {
    pub fn new(schema: &'a Schema, record: &'a Record, time: f64) -> Self {
        let mut inputs = Self { schema, record, pieces: Vec::new() };
        inputs.enter(time);
        inputs
    }

    /// Selects for each input the interval between samples that contains `time` or begins there.
    pub fn enter(&mut self, time: f64) {
        let streams = self.record.inputs.iter();
        self.pieces = streams.map(|s| s.times.partition_point(|&t| t <= time).checked_sub(1)).collect();
    }

    /// End of the current interval that ends first, s; infinity if none ends.
    pub fn end(&self) -> f64 {
        let ends = self.record.inputs.iter().zip(&self.pieces).filter_map(|(s, piece)| {
            let next = piece.map_or(0, |i| i + 1);
            s.times.get(next).copied()
        });
        ends.fold(f64::INFINITY, f64::min)
    }

    /// Writes the interpolated columns of all inputs at `time`, on the current intervals, to `out`.
    pub fn at<S: Scalar>(&self, time: S, out: &mut Vec<S>) {
        out.clear();
        for ((stream, piece), input) in self.record.inputs.iter().zip(&self.pieces).zip(&self.schema.inputs) {
            let first = piece.unwrap_or(0);
            // Before the first sample and after the last there is nothing to go to: the value is held.
            let span = match (piece, input.interpolation) {
                (Some(i), InputInterpolation::Linear) => {
                    stream.times.get(i + 1).map(|t| t - stream.times[*i])
                }
                _ => None,
            };
            for column in &stream.values {
                let value = column.get(first).copied().unwrap_or(f64::NAN);
                out.push(match span {
                    None => S::constant(value),
                    Some(span) => {
                        let slope = (column[first + 1] - value) / span;
                        (time - stream.times[first]) * slope + value
                    }
                });
            }
        }
    }
}
