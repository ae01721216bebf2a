//! The linear problem at a fitted set, from the columns of all candidates.

use super::builder::ProblemBuilder;
use super::linear_problem::LinearProblem;
use super::periodogram::strongest_cycles;
use crate::addition::Addition;
use crate::record::ChosenRecords;
use crate::score::{Blocks, FitWindows, Rows, Scored};

/// Number of samples to which windows are thinned out where candidates are only ranked: for periodograms, which need hundreds
/// of simulations, and for the choice of the sets that are then fitted to all data.
///
/// An effect with 1 % of the residual variance gains 20 nats in this many.
pub(super) const MAX_SAMPLES: usize = 4096;

impl LinearProblem {
    /// Creates the linear problem at the fitted set `set`, with the candidates `library`.
    pub fn new(sample: &ChosenRecords<'_>, blocks: &Blocks, set: &Scored, library: &[Addition]) -> Self {
        let places = FitWindows::new(sample, &set.fit);
        let rows = places.rows(blocks);
        Self::of_windows((&places, &rows), blocks, set, library, rows.samples() as f64)
    }

    /// As [`new`](Self::new), from a part of the windows where there are many: its gains rank the candidates, and are no
    /// tests.
    pub fn for_ranking(
        sample: &ChosenRecords<'_>,
        blocks: &Blocks,
        set: &Scored,
        library: &[Addition],
    ) -> Self {
        let places = FitWindows::new(sample, &set.fit);
        let channels = sample.data.system.schema().channels.len();
        let samples: usize = places.windows.iter().map(|at| channels * at.window.samples.len()).sum();
        let thinning =
            samples.div_ceil(MAX_SAMPLES).clamp(1, places.windows.len().div_ceil(blocks.count).max(1));
        if thinning == 1 {
            return Self::new(sample, blocks, set, library);
        }
        let fit = places.fit_at_every(thinning);
        let part = places.at_every(thinning, &fit);
        let rows = part.rows(blocks);
        let share = part.windows.len() as f64 / places.windows.len() as f64;
        Self::of_windows((&part, &rows), blocks, set, library, rows.samples() as f64 / share)
    }

    /// Creates the linear problem from some windows of a set; `samples` is the number of residuals in all of them.
    fn of_windows(
        (places, rows): (&FitWindows<'_>, &Rows),
        blocks: &Blocks,
        set: &Scored,
        library: &[Addition],
        samples: f64,
    ) -> Self {
        let cycles = strongest_cycles(places, rows, set, library);
        let mut builder = ProblemBuilder::new(places, rows, set);
        builder.add_slopes(library, &cycles);
        builder.add_changes(library);
        builder.add_splits(library);
        builder.finish(blocks.count, samples, set.evidence.independence.share)
    }
}
