//! Random split of a data set into training and test trajectories.
//!
//! Whole trajectories are assigned, never samples: neighbouring samples are so similar that a split among
//! them would leak training data into the test.

use crate::dataset::Dataset;
use crate::error::DataError;
use crate::random_stream::random_stream;
use rand::Rng;
use serde::{Deserialize, Serialize};

/// Sizes of the training set and the test set.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SplitSize {
    /// Share of the trajectories for training, rounded so that each set has at least one; the others test.
    ///
    /// The share is between 0 and 1, exclusive.
    TrainFraction(f64),
    /// Numbers of trajectories for each set; further trajectories are not used.
    Counts {
        /// Number of trajectories for training.
        train: usize,
        /// Number of trajectories for testing.
        test: usize,
    },
}

/// Indices of training and test trajectories, ascending and disjoint.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Split {
    /// Indices of the trajectories for training.
    pub train: Vec<usize>,
    /// Indices of the trajectories for testing.
    pub test: Vec<usize>,
}

impl Split {
    /// Splits `trajectories` trajectories at random; the same seed gives the same split.
    ///
    /// ```
    /// use augsim_data::{Split, SplitSize};
    /// let split = Split::random(10, SplitSize::TrainFraction(0.7), 1)?;
    /// assert_eq!((split.train.len(), split.test.len()), (7, 3));
    /// assert!(split.test.iter().all(|index| !split.train.contains(index)));
    /// assert_eq!(split, Split::random(10, SplitSize::TrainFraction(0.7), 1)?); // the seed decides
    /// # Ok::<(), augsim_data::DataError>(())
    /// ```
    ///
    /// # Errors
    /// The fraction is outside (0, 1), or a size is zero or their sum exceeds `trajectories`.
    pub fn random(trajectories: usize, size: SplitSize, seed: u64) -> Result<Split, DataError> {
        let (train, test) = match size {
            SplitSize::TrainFraction(fraction) => {
                if !(fraction > 0.0 && fraction < 1.0) {
                    return Err(DataError::BadFraction { fraction });
                }
                let train = (fraction * trajectories as f64).round() as usize;
                let train = train.min(trajectories.saturating_sub(1)).max(1);
                (train, trajectories.saturating_sub(train))
            }
            SplitSize::Counts { train, test } => (train, test),
        };
        let is_available = train.checked_add(test).is_some_and(|sum| sum <= trajectories);
        if train == 0 || test == 0 || !is_available {
            return Err(DataError::BadSplit { trajectories, train, test });
        }
        let order = shuffled(trajectories, &mut random_stream(seed, "split", 0));
        let sorted = |part: &[usize]| {
            let mut part = part.to_vec();
            part.sort_unstable();
            part
        };
        Ok(Split { train: sorted(&order[..train]), test: sorted(&order[train..train + test]) })
    }

    /// Returns the training set and the test set of `dataset`.
    ///
    /// # Panics
    /// The split was made for more trajectories than `dataset` has.
    pub fn apply(&self, dataset: &Dataset) -> (Dataset, Dataset) {
        (dataset.select(&self.train), dataset.select(&self.test))
    }
}

/// Random permutation of `0..count` (Fisher-Yates).
///
/// It is implemented here so that library updates do not change a split.
fn shuffled(count: usize, rng: &mut impl Rng) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    for last in (1..count).rev() {
        order.swap(last, below(last as u64 + 1, rng) as usize);
    }
    order
}

/// Uniform random number in `0..bound`: the high half of a 128-bit product.
///
/// The bias is at most bound / 2^64, which is negligible.
fn below(bound: u64, rng: &mut impl Rng) -> u64 {
    ((u128::from(rng.next_u64()) * u128::from(bound)) >> 64) as u64
}

#[cfg(test)]
mod tests {
    //! Contract: training and test trajectories are disjoint and have the requested sizes.
    //!
    //! They depend only on the seed. Impossible sizes are an error that states them.
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn parts_are_disjoint_and_have_the_requested_sizes(
            train in 1_usize..40, test in 1_usize..40, spare in 0_usize..20, seed: u64,
        ) {
            let count = train + test + spare;
            let size = SplitSize::Counts { train, test };
            let split = Split::random(count, size, seed).unwrap();
            prop_assert_eq!((split.train.len(), split.test.len()), (train, test));
            let mut both = [split.train.clone(), split.test.clone()].concat();
            both.sort_unstable();
            both.dedup();
            prop_assert_eq!(both.len(), train + test);
            prop_assert!(both.iter().all(|&i| i < count));
            prop_assert_eq!(Split::random(count, size, seed).unwrap(), split);
        }

        #[test]
        fn a_fraction_uses_every_trajectory(count in 2_usize..200, fraction in 0.001_f64..0.999) {
            let split = Split::random(count, SplitSize::TrainFraction(fraction), 1).unwrap();
            prop_assert_eq!(split.train.len() + split.test.len(), count);
            prop_assert!((split.train.len() as f64 - fraction * count as f64).abs() <= 1.0);
        }
    }

    #[test]
    fn every_trajectory_is_equally_likely_to_be_tested() {
        // 4000 seeds, 10 of 20: each count is binomial with mean 2000 and sd 31.6; the bound is six sd.
        let mut counts = [0_i32; 20];
        for seed in 0..4000 {
            let split = Split::random(20, SplitSize::TrainFraction(0.5), seed).unwrap();
            split.test.iter().for_each(|&i| counts[i] += 1);
        }
        assert!(counts.iter().all(|c| (c - 2000).abs() < 190), "{counts:?}");
    }

    #[test]
    fn impossible_sizes_are_errors() {
        let error = Split::random(10, SplitSize::Counts { train: 8, test: 3 }, 0).unwrap_err();
        assert_eq!(
            error.to_string(),
            "cannot split 10 trajectories into 8 for training and 3 for testing; use at least one for each and at most \
             10 together"
        );
        let error = Split::random(10, SplitSize::TrainFraction(80.0), 0).unwrap_err();
        assert_eq!(error.to_string(), "training fraction 80 is not between 0 and 1; use for example 0.8");
        assert!(Split::random(1, SplitSize::TrainFraction(0.5), 0).is_err());
        assert!(Split::random(0, SplitSize::TrainFraction(0.5), 0).is_err());
        assert!(Split::random(5, SplitSize::Counts { train: usize::MAX, test: 2 }, 0).is_err());
        assert!(Split::random(5, SplitSize::TrainFraction(f64::NAN), 0).is_err());
    }
}
