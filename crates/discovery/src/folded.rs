//! Parts of the data that are left out in turn, so that all of it is foretold by fits that have not seen it.
//!
//! One held-out part of a short recording is a few stretches, and chance decides between two answers there. Every so manieth block of
//! all is left out in turn (blocked cross-validation, Burman, Chow and Nolan 1994).

use crate::fit::ChosenRecords;
use crate::free_runs::FreeRuns;
use crate::part::is_long;

/// Parts of other data that are left out in turn.
const PARTS: usize = 4;
/// Parts of long data that are left out in turn: its halves say enough.
const HALVES: usize = 2;

/// A part that is left out.
pub(crate) struct LeftOut {
    /// The numbers of the other records.
    rest: Vec<usize>,
    /// Free runs over the part.
    pub runs: FreeRuns,
}

impl LeftOut {
    /// The records that are not left out, of the data of `sample`.
    pub fn rest<'s>(&'s self, sample: &ChosenRecords<'s>) -> ChosenRecords<'s> {
        ChosenRecords { chosen: &self.rest, ..*sample }
    }
}

/// Parts of all data that are left out in turn; `None` where fits see no recording in several windows.
pub(crate) fn folded(train: &ChosenRecords<'_>, test: &ChosenRecords<'_>) -> Option<Vec<LeftOut>> {
    let mut all = [train.chosen, test.chosen].concat();
    all.sort_unstable();
    let parts = if is_long(train) { HALVES } else { PARTS };
    let of = |part: usize| {
        let (out, rest) = left_out(&all, part, parts);
        let runs = FreeRuns::new(&ChosenRecords { chosen: &out, ..*train })?;
        Some(LeftOut { rest, runs })
    };
    (0..parts).map(of).collect()
}

/// Every so manieth of `all`, beginning with number `part`, and the rest.
fn left_out(all: &[usize], part: usize, parts: usize) -> (Vec<usize>, Vec<usize>) {
    let numbered = all.iter().copied().enumerate();
    let (out, rest): (Vec<_>, Vec<_>) = numbered.partition(|(number, _)| number % parts == part);
    let of = |list: Vec<(usize, usize)>| list.into_iter().map(|(_, j)| j).collect();
    (of(out), of(rest))
}

#[cfg(test)]
mod tests {
    //! Contract: each block is left out once, and neighbours in different parts.
    use super::*;

    #[test]
    fn each_block_is_left_out_once() {
        let all = [2, 3, 5, 8, 13, 21];
        let parts: Vec<_> = (0..4).map(|part| left_out(&all, part, 4)).collect();
        assert_eq!(parts[1], (vec![3, 21], vec![2, 5, 8, 13]));
        let mut out: Vec<usize> = parts.iter().flat_map(|(out, _)| out.clone()).collect();
        out.sort_unstable();
        assert_eq!(out, all);
    }
}
