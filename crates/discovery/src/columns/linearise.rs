//! The linear problem at a fitted set, from the columns of all candidates.

use super::builder::ProblemBuilder;
use super::periodogram::strongest_cycles;
use crate::addition::{Addition, labels};
use crate::linear_problem::LinearProblem;
use crate::record::ChosenRecords;
use crate::score::{Blocks, FitWindows, Scored};
use std::sync::Arc;

/// The linear problem at the fitted set `set`, with the candidates `library`. It is kept with the set.
pub(crate) fn linearise(
    sample: &ChosenRecords<'_>,
    blocks: &Blocks,
    set: &Scored,
    library: &[Addition],
) -> Arc<LinearProblem> {
    let build = || {
        let places = FitWindows::new(sample, &set.fit);
        let rows = places.rows(blocks);
        let cycles = strongest_cycles(&places, &rows, set, library);
        let mut builder = ProblemBuilder::new(&places, &rows, set);
        builder.add_slopes(library, &cycles);
        builder.add_changes(library);
        builder.add_splits(library);
        Arc::new(builder.finish(blocks.count, set.evidence.independence.share))
    };
    set.problems.of(labels(library), build, || !sample.data.clock.is_over())
}
