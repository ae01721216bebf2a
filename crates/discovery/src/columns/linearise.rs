//! The linear problem at a fitted set, from the columns of all candidates.

use super::builder::ProblemBuilder;
use super::linear_problem::LinearProblem;
use super::periodogram::strongest_cycles;
use crate::addition::Addition;
use crate::record::ChosenRecords;
use crate::score::{Blocks, FitWindows, Scored};

impl LinearProblem {
    /// Creates the linear problem at the fitted set `set`, with the candidates `library`.
    pub fn new(sample: &ChosenRecords<'_>, blocks: &Blocks, set: &Scored, library: &[Addition]) -> Self {
        let places = FitWindows::new(sample, &set.fit);
        let rows = places.rows(blocks);
        let cycles = strongest_cycles(&places, &rows, set, library);
        let mut builder = ProblemBuilder::new(&places, &rows, set);
        builder.add_slopes(library, &cycles);
        builder.add_changes(library);
        builder.add_splits(library);
        builder.finish(blocks.count, set.evidence.independence.share)
    }
}
