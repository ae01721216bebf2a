//! Blocks: the stretches of the data that are left out one by one.
//!
//! Neighbouring samples err alike, so a block is a stretch of time, or whole recordings where there are many (blocked
//! cross-validation: Burman, Chow and Nolan 1994). The data fix the blocks; no seed does.

use crate::chosen_records::ChosenRecords;

/// Blocks that few recordings are cut into. Fewer leave Student's law with a heavy tail (15 degrees of freedom ask for 4.9 standard
/// errors at a level of 0.01 over 60 candidates, 7 would ask for 7.0); many more would be shorter than the memory of a residual.
pub(crate) const BLOCKS: usize = 16;
/// Most blocks: from 40 on Student's law is normal to 10 % at the levels that are asked for, and work grows with their number.
const MOST_BLOCKS: usize = 40;

/// The block of every sample of some records.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Blocks {
    pub count: usize,
    /// Whether blocks are stretches of recordings, so that one goes on where another ends.
    pub touch: bool,
    /// `[chosen record][sample]`.
    of: Vec<Vec<u16>>,
}

impl Blocks {
    /// Blocks of a sample that comes of so many `recordings`, in order: groups of recordings where these are as many as the blocks, else
    /// stretches with equal numbers of measured samples.
    pub fn new(sample: &ChosenRecords<'_>, recordings: usize) -> Self {
        let records: Vec<Vec<bool>> = sample
            .records()
            .map(|r| (0..r.seen.times.len()).map(|k| r.weight.iter().any(|w| w[k] != 0.0)).collect())
            .collect();
        Self::of(&records, recordings)
    }

    /// Blocks of records of which each sample counts or does not.
    fn of(records: &[Vec<bool>], recordings: usize) -> Self {
        let total: usize = records.iter().flatten().filter(|counts| **counts).count();
        let whole = recordings >= BLOCKS && records.len() >= BLOCKS;
        let count = if whole { records.len().min(MOST_BLOCKS) } else { BLOCKS.min(total.max(1)) };
        let mut before = 0;
        let of = records.iter().enumerate().map(|(r, counted)| {
            let of_sample = |counts: &bool| {
                let place = if whole { r * count / records.len() } else { before * count / total.max(1) };
                before += usize::from(*counts);
                place.min(count - 1) as u16
            };
            counted.iter().map(of_sample).collect()
        });
        let of = of.collect();
        Self { count, touch: !whole, of }
    }

    /// The block of a sample of a chosen record.
    pub fn block(&self, chosen: usize, sample: usize) -> u16 {
        self.of[chosen][sample]
    }
}

#[cfg(test)]
impl Blocks {
    /// So many blocks, whose samples are not asked for.
    pub fn apart(count: usize) -> Self {
        Self { count, touch: false, of: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: few recordings are cut into sixteen stretches of as many measured samples, many recordings are blocks themselves.
    use super::*;

    fn blocks(records: usize, samples: usize) -> Blocks {
        Blocks::of(&vec![vec![true; samples]; records], records)
    }

    #[test]
    fn few_recordings_are_cut_and_many_are_not() {
        let few = blocks(2, 80);
        assert_eq!((few.count, few.touch), (16, true));
        assert_eq!([few.block(0, 0), few.block(0, 9), few.block(0, 10), few.block(1, 79)], [0, 0, 1, 15]);
        let many = blocks(20, 5);
        assert_eq!((many.count, many.touch), (20, false));
        assert_eq!([many.block(0, 4), many.block(7, 0), many.block(19, 4)], [0, 7, 19]);
        assert_eq!(blocks(100, 2).count, 40);
    }
}
