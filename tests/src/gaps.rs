//! Empty cells in generated data: a given share of each column, single or in runs.

use augsim_data::{DataError, Dataset};
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Lengths of the runs of empty cells, in cells: up to 0.2 s at 100 Hz.
const RUN_LENGTHS: std::ops::RangeInclusive<usize> = 2..=20;

/// Share and pattern of the empty cells of a data set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaps {
    /// Share of cells that are empty.
    pub share: f64,
    /// Whether empty cells come in runs of one column, as when a marker is hidden, or singly.
    pub runs: bool,
}

impl Gaps {
    /// Share and pattern for a seed: eight combinations in turn.
    pub fn of_seed(seed: u64) -> Self {
        let shares = [0.001, 0.01, 0.03, 0.1];
        Self { share: shares[(seed / 2 % 4) as usize], runs: seed % 2 == 1 }
    }

    /// Returns `data` with cells emptied at random; a row without any value is kept, as readers allow it.
    ///
    /// # Errors
    /// None for a valid data set.
    pub fn cut(self, data: &Dataset, rng: &mut Xoshiro256PlusPlus) -> Result<Dataset, DataError> {
        let mean_length =
            if self.runs { (RUN_LENGTHS.start() + RUN_LENGTHS.end()) as f64 / 2.0 } else { 1.0 };
        let cut = data
            .trajectories()
            .iter()
            .map(|t| {
                let mut values = t.values().to_vec();
                for column in &mut values {
                    let mut k = 0;
                    while k < column.len() {
                        // Longer runs start less often, so that the share of empty cells stays the same.
                        if rng.random::<f64>() < self.share / mean_length {
                            let length = if self.runs { rng.random_range(RUN_LENGTHS) } else { 1 };
                            let end = column.len().min(k + length);
                            column[k..end].fill(f64::NAN);
                            k = end;
                        } else {
                            k += 1;
                        }
                    }
                }
                t.with_samples(t.time_s().to_vec(), values)
            })
            .collect::<Result<Vec<_>, _>>()?;
        Dataset::from_names(&data.columns().iter().map(|c| c.name()).collect::<Vec<_>>(), cut)
    }
}
