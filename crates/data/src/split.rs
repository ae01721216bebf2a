//! Random division into training and test trajectories.
//!
//! Whole trajectories are dealt out, never samples: neighbouring samples are so alike that a split
//! among them would test on what was trained on.

use crate::dataset::Dataset;
use crate::error::DataError;
use crate::random_stream::random_stream;
use rand::Rng;
use serde::{Deserialize, Serialize};

/// How many trajectories go where.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SplitSize {
    /// This fraction for training (rounded to the nearest whole number, at least one on each side),
    /// the rest for testing.
    TrainFraction(f64),
    /// Exactly so many; what is left over is used for neither.
    Counts {
        /// Trajectories for training.
        train: usize,
        /// Trajectories for testing.
        test: usize,
    },
}

/// Indices of trajectories, ascending; the two never overlap.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Split {
    /// Indices of the trajectories for training.
    pub train: Vec<usize>,
    /// Indices of the trajectories for testing.
    pub test: Vec<usize>,
}

impl Split {
    /// Deals `trajectories` trajectories out at random; the same seed gives the same split.
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
    /// A fraction outside (0, 1), or sizes that are zero or more than there are.
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
        let enough = train.checked_add(test).is_some_and(|sum| sum <= trajectories);
        if train == 0 || test == 0 || !enough {
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

    /// The training and the test set of `dataset`.
    ///
    /// # Panics
    /// The split was made for more trajectories than `dataset` has.
    pub fn apply(&self, dataset: &Dataset) -> (Dataset, Dataset) {
        (dataset.select(&self.train), dataset.select(&self.test))
    }
}

/// Fisher-Yates, written out so that a split does not change with the version of a library.
fn shuffled(count: usize, rng: &mut impl Rng) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    for last in (1..count).rev() {
        order.swap(last, below(last as u64 + 1, rng) as usize);
    }
    order
}

/// Uniform on 0..bound: the high half of a 128-bit product. Its bias is at most bound / 2^64, far
/// below anything that could be seen.
fn below(bound: u64, rng: &mut impl Rng) -> u64 {
    ((u128::from(rng.next_u64()) * u128::from(bound)) >> 64) as u64
}

#[cfg(test)]
mod tests {
    //! Contract: train and test are disjoint, of the sizes asked for, and a pure function of the
    //! seed; what cannot be had is an error with the numbers in it.
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn parts_are_disjoint_and_of_the_sizes_asked_for(
            train in 1_usize..40, test in 1_usize..40, spare in 0_usize..20, seed: u64,
        ) {
            let all = train + test + spare;
            let size = SplitSize::Counts { train, test };
            let split = Split::random(all, size, seed).unwrap();
            prop_assert_eq!((split.train.len(), split.test.len()), (train, test));
            let mut both = [split.train.clone(), split.test.clone()].concat();
            both.sort_unstable();
            both.dedup();
            prop_assert_eq!(both.len(), train + test);
            prop_assert!(both.iter().all(|&i| i < all));
            prop_assert_eq!(Split::random(all, size, seed).unwrap(), split);
        }

        #[test]
        fn a_fraction_uses_every_trajectory(all in 2_usize..200, fraction in 0.001_f64..0.999) {
            let split = Split::random(all, SplitSize::TrainFraction(fraction), 1).unwrap();
            prop_assert_eq!(split.train.len() + split.test.len(), all);
            prop_assert!((split.train.len() as f64 - fraction * all as f64).abs() <= 1.0);
        }
    }

    #[test]
    fn every_trajectory_is_as_likely_to_be_tested() {
        // 4000 seeds, 10 of 20: each count is binomial with mean 2000 and sd 31.6; six of those.
        let mut counts = [0_i32; 20];
        for seed in 0..4000 {
            let split = Split::random(20, SplitSize::TrainFraction(0.5), seed).unwrap();
            split.test.iter().for_each(|&i| counts[i] += 1);
        }
        assert!(counts.iter().all(|c| (c - 2000).abs() < 190), "{counts:?}");
    }

    #[test]
    fn impossible_sizes_say_so() {
        let error = Split::random(10, SplitSize::Counts { train: 8, test: 3 }, 0).unwrap_err();
        assert_eq!(
            error.to_string(),
            "cannot split 10 trajectories into 8 for training and 3 for testing; both need at \
             least one and together at most 10"
        );
        let error = Split::random(10, SplitSize::TrainFraction(80.0), 0).unwrap_err();
        assert_eq!(error.to_string(), "training fraction 80 is not between 0 and 1; use for example 0.8");
        assert!(Split::random(1, SplitSize::TrainFraction(0.5), 0).is_err());
        assert!(Split::random(0, SplitSize::TrainFraction(0.5), 0).is_err());
        assert!(Split::random(5, SplitSize::Counts { train: usize::MAX, test: 2 }, 0).is_err());
        assert!(Split::random(5, SplitSize::TrainFraction(f64::NAN), 0).is_err());
    }
}
