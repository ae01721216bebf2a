//! Blocks: the parts of the data that are left out one by one.
//!
//! Residuals of neighbouring samples are correlated, so a block is a segment of time, or whole recordings
//! where there are many (blocked cross-validation: Burman, Chow and Nolan 1994). Blocks depend on the data
//! alone, not on a seed.

use crate::record::ChosenRecords;

/// Number of blocks into which few recordings are divided. Fewer give Student's t heavy tails (with 15
/// degrees of freedom a level of 0.01 over 60 candidates requires 4.9 standard errors, with 7 it would
/// require 7.0); many more would be shorter than the autocorrelation time of the residuals.
pub(crate) const BLOCKS: usize = 16;
/// Maximum number of blocks. From 40 on Student's t is normal to 10 % at the required levels, and the work
/// grows with the number.
const MAX_BLOCKS: usize = 40;

/// Assignment of every sample of some records to a block, which is left out as a whole.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Blocks {
    pub count: usize,
    /// Whether blocks are adjacent segments of recordings, rather than groups of whole recordings.
    pub are_adjacent: bool,
    /// Block of each sample, `[chosen record][sample]`.
    block_of: Vec<Vec<u16>>,
}

impl Blocks {
    /// Divides a sample from `recordings` recordings into blocks, in order. They are groups of whole
    /// recordings if there are at least 16, else segments with equal numbers of measured samples.
    pub fn new(sample: &ChosenRecords<'_>, recordings: usize) -> Self {
        let records: Vec<Vec<bool>> = sample
            .records()
            .map(|r| (0..r.data.times.len()).map(|k| r.weight.iter().any(|w| w[k] != 0.0)).collect())
            .collect();
        Self::from_counts(&records, recordings)
    }

    /// Divides records into blocks; `records` says for each sample whether it counts.
    fn from_counts(records: &[Vec<bool>], recordings: usize) -> Self {
        let total: usize = records.iter().flatten().filter(|counts| **counts).count();
        let whole = recordings >= BLOCKS && records.len() >= BLOCKS;
        let count = if whole { records.len().min(MAX_BLOCKS) } else { BLOCKS.min(total.max(1)) };
        let mut before = 0;
        let assigned = records.iter().enumerate().map(|(r, counted)| {
            let next_block = |counts: &bool| {
                let place = if whole { r * count / records.len() } else { before * count / total.max(1) };
                before += usize::from(*counts);
                place.min(count - 1) as u16
            };
            counted.iter().map(next_block).collect()
        });
        Self { count, are_adjacent: !whole, block_of: assigned.collect() }
    }

    /// Number of the block that contains a sample of a chosen record.
    pub fn block(&self, chosen: usize, sample: usize) -> u16 {
        self.block_of[chosen][sample]
    }
}

#[cfg(test)]
impl Blocks {
    /// Blocks that contain no samples.
    pub fn without_samples(count: usize) -> Self {
        Self { count, are_adjacent: false, block_of: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: few recordings are cut into sixteen segments with equal numbers of measured samples; many
    //! recordings are blocks themselves.
    use super::*;

    fn blocks(records: usize, samples: usize) -> Blocks {
        Blocks::from_counts(&vec![vec![true; samples]; records], records)
    }

    #[test]
    fn few_recordings_are_cut_and_many_are_not() {
        let few = blocks(2, 80);
        assert_eq!((few.count, few.are_adjacent), (16, true));
        assert_eq!([few.block(0, 0), few.block(0, 9), few.block(0, 10), few.block(1, 79)], [0, 0, 1, 15]);
        let many = blocks(20, 5);
        assert_eq!((many.count, many.are_adjacent), (20, false));
        assert_eq!([many.block(0, 4), many.block(7, 0), many.block(19, 4)], [0, 7, 19]);
        assert_eq!(blocks(100, 2).count, 40);
    }
}
