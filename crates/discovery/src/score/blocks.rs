//! Blocks: the parts of the data that are left out one by one.
//!
//! Residuals of neighbouring samples are correlated, so a block is a segment of time, or whole recordings
//! where there are many (blocked cross-validation: Burman, Chow and Nolan 1994). Blocks depend on the data
//! alone, not on a seed.
//!
//! Where the recordings belong to groups, every group has at least two blocks of its own: leaving out a block
//! then leaves data on the values of its group.

use crate::record::ChosenRecords;
use std::collections::BTreeSet;

/// Number of blocks into which few recordings are divided. Fewer give Student's t heavy tails (with 15
/// degrees of freedom a level of 0.01 over 60 candidates requires 4.9 standard errors, with 7 it would
/// require 7.0); many more would be shorter than the autocorrelation time of the residuals.
pub(crate) const BLOCKS: usize = 16;
/// Maximum number of blocks. From 40 on Student's t is normal to 10 % at the required levels, and the work
/// grows with the number.
const MAX_BLOCKS: usize = 40;

/// Minimum number of blocks of each group of records, so that each block of a group is predicted from others.
const MIN_BLOCKS_PER_GROUP: usize = 2;
/// Maximum number of groups for which values by group are tried. More would describe the data, not explain
/// them; and each has [`MIN_BLOCKS_PER_GROUP`] of at most [`MAX_BLOCKS`] blocks.
const MAX_GROUPS: usize = MAX_BLOCKS / MIN_BLOCKS_PER_GROUP;

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
    /// recordings if there are at least 16, else segments with equal numbers of measured samples. If whole
    /// recordings would leave a group with a single block, or there are few recordings of several groups, each
    /// group has segments of its own.
    pub fn new(sample: &ChosenRecords<'_>, recordings: usize) -> Self {
        let records: Vec<Vec<bool>> = sample
            .records()
            .map(|r| (0..r.data.times.len()).map(|k| r.weight.iter().any(|w| w[k] != 0.0)).collect())
            .collect();
        let groups: Vec<usize> = sample.records().map(|r| r.data.group).collect();
        Self::of_groups(&records, &groups, recordings)
    }

    /// Divides records of these groups into blocks.
    fn of_groups(records: &[Vec<bool>], groups: &[usize], recordings: usize) -> Self {
        let without_groups = Self::from_counts(records, recordings);
        let present: BTreeSet<usize> = groups.iter().copied().collect();
        let blocks_of = |group: &usize| {
            let of_group = groups.iter().zip(&without_groups.block_of).filter(|(g, _)| *g == group);
            of_group.flat_map(|(_, blocks)| blocks).collect::<BTreeSet<_>>().len()
        };
        let is_enough = || present.iter().all(|group| blocks_of(group) >= MIN_BLOCKS_PER_GROUP);
        if !are_comparable(present.len()) || !without_groups.are_adjacent && is_enough() {
            return without_groups;
        }
        let each = BLOCKS.div_ceil(present.len()).max(MIN_BLOCKS_PER_GROUP);
        let mut block_of: Vec<Vec<u16>> = vec![Vec::new(); records.len()];
        for (rank, group) in present.iter().enumerate() {
            let of_group: Vec<usize> = (0..records.len()).filter(|r| groups[*r] == *group).collect();
            let total = of_group.iter().flat_map(|r| &records[*r]).filter(|counts| **counts).count().max(1);
            let mut before = 0;
            for r in of_group {
                let next_block = |counts: &bool| {
                    let place = (before * each / total).min(each - 1);
                    before += usize::from(*counts);
                    (rank * each + place) as u16
                };
                block_of[r] = records[r].iter().map(next_block).collect();
            }
        }
        Self { count: each * present.len(), are_adjacent: true, block_of }
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

/// Whether so many groups are compared: there are at least two, and not so many that their values would describe
/// the data instead of explaining them.
pub(crate) fn are_comparable(groups: usize) -> bool {
    (2..=MAX_GROUPS).contains(&groups)
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

    #[test]
    fn every_group_has_blocks_of_its_own() {
        let of_groups = |groups: &[usize], samples: usize| {
            Blocks::of_groups(&vec![vec![true; samples]; groups.len()], groups, groups.len())
        };
        // Three recordings of two groups: eight blocks for each group.
        let few = of_groups(&[0, 1, 1], 80);
        assert_eq!((few.count, few.are_adjacent), (16, true));
        let places = [few.block(0, 9), few.block(0, 79), few.block(1, 0), few.block(1, 79), few.block(2, 79)];
        assert_eq!(places, [0, 7, 8, 11, 15]);
        // Twenty groups of one recording: two blocks for each.
        let many = of_groups(&(0..20).collect::<Vec<_>>(), 10);
        assert_eq!((many.count, many.are_adjacent), (40, true));
        assert_eq!([many.block(7, 4), many.block(7, 5)], [14, 15]);
        // Twenty recordings of two groups are blocks themselves, and so are those of more groups than are compared.
        let pairs: Vec<usize> = (0..20).map(|r| r % 2).collect();
        assert_eq!(of_groups(&pairs, 5), blocks(20, 5));
        assert_eq!(of_groups(&(0..21).collect::<Vec<_>>(), 5), blocks(21, 5));
    }
}
