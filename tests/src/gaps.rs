//! Empty cells in sealed data: a share of the cells of every column, alone or in runs.

use augsim_data::{DataError, Dataset};
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Lengths of the runs, in cells: from two to a fifth of a second at 100 Hz.
const RUN: std::ops::RangeInclusive<usize> = 2..=20;

/// Which cells of a set are empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaps {
    /// Share of the cells.
    pub share: f64,
    /// Whether they come in runs of one column, as when a marker is covered, or each by itself.
    pub runs: bool,
}

impl Gaps {
    /// The eight combinations of share and pattern in turn.
    pub fn of_seed(seed: u64) -> Self {
        let shares = [0.001, 0.01, 0.03, 0.1];
        Self { share: shares[(seed / 2 % 4) as usize], runs: seed % 2 == 1 }
    }

    /// The set with these cells empty. A row that would lose every cell keeps its place: readers allow it.
    ///
    /// # Errors
    /// None that a well-formed set can cause.
    pub fn cut(self, data: &Dataset, rng: &mut Xoshiro256PlusPlus) -> Result<Dataset, DataError> {
        let mean = if self.runs { (RUN.start() + RUN.end()) as f64 / 2.0 } else { 1.0 };
        let cut = data
            .trajectories()
            .iter()
            .map(|t| {
                let mut values = t.values().to_vec();
                for column in &mut values {
                    let mut k = 0;
                    while k < column.len() {
                        // Runs begin so much more seldom as they are longer.
                        if rng.random::<f64>() < self.share / mean {
                            let length = if self.runs { rng.random_range(RUN) } else { 1 };
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
