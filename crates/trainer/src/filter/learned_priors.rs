//! Priors of the quantities that differ from trajectory to trajectory, learned from whole trajectories.
//!
//! Each trajectory is fitted under the current priors (mode and curvature). The next prior of a quantity
//! has
//!
//! ```text
//! (1)  mean = median of the modes,
//! (2)  variance = mean of (mode - mean)^2 + posterior variance,
//! ```
//!
//! an approximate expectation-maximisation step (Dempster, Laird, Rubin 1977); medians and a cap on (2)
//! make it robust. The prior of a quantity that does not differ between trajectories shrinks to one value;
//! that of a quantity that the data do not identify stays as it is.

use super::prefix::Prefix;
use super::system::SystemFilter;
use super::{InitialStatePrior, Sensor};
use crate::{Sequences, TrainerError};
use augsim_system::Seed;
use augsim_system::statistics::median;
use rayon::prelude::*;

/// Number of expectation-maximisation rounds in which the priors are learned.
/// Well identified quantities converge in three, those that only some trajectories identify in about ten.
const EM_ROUNDS: usize = 12;
/// Cap on squared distances of modes from the mean of a prior, in variances of the current prior.
/// A single outlier, such as a ball that hit the net, then does not widen the prior of all others.
const MAX_SQUARED_DISTANCE: f64 = 9.0;
/// Minimum standard deviation of a learned prior, as a share of that of the initial prior.
const MIN_SD_SHARE: f64 = 1e-3;

/// Learned priors of the quantities that differ between trajectories, and learned measurement noise.
#[derive(Debug, Clone, PartialEq)]
pub struct LearnedPriors {
    laws: Vec<(Seed, f64, f64)>,
    noise: Vec<f64>,
}

impl LearnedPriors {
    /// Learns the priors of all parameters that `filter` estimates for each trajectory.
    /// `train` are the whole trajectories for whose records the filter was made.
    ///
    /// # Errors
    /// [`TrainerError`] if no trajectory can be fitted.
    pub fn learn(filter: &SystemFilter, train: &Sequences) -> Result<Self, TrainerError> {
        let mut filter = filter.clone();
        let channels = train.state_dim();
        let sensor = Sensor::exact(channels);
        let start = InitialStatePrior { mean: Vec::new(), sd: Vec::new() };
        let indices = filter.prior_indices();
        let min_sd: Vec<f64> = indices.iter().map(|&i| MIN_SD_SHARE * filter.prior(i).1).collect();
        let mut noise = vec![0.0; channels];
        for _ in 0..EM_ROUNDS {
            let fits: Vec<(Vec<[f64; 2]>, Vec<f64>)> = (train.items.par_iter().enumerate())
                .filter_map(|(index, q)| {
                    let prefix = Prefix {
                        id: &q.id,
                        rows: &q.states,
                        sensor: &sensor,
                        start: &start,
                        actions: &q.actions,
                        time: q.time,
                        index: index as u64,
                    };
                    filter.fit_unknowns(&prefix, &indices).ok()
                })
                .collect();
            if fits.is_empty() {
                return Err(TrainerError::NoTrajectories {
                    what: "the part of the training set whose trajectories can be fitted",
                });
            }
            let count = fits.len() as f64;
            for (k, &index) in indices.iter().enumerate() {
                let (_, sd) = filter.prior(index);
                let mean = median(&mut fits.iter().map(|(estimates, _)| estimates[k][0]).collect::<Vec<_>>());
                let square = |estimates: &[[f64; 2]]| {
                    ((estimates[k][0] - mean).powi(2) + estimates[k][1]).min(MAX_SQUARED_DISTANCE * sd * sd)
                };
                let variance = fits.iter().map(|(estimates, _)| square(estimates)).sum::<f64>() / count;
                filter.set_prior(index, (mean, variance.sqrt().max(min_sd[k])));
            }
            for (c, noise) in noise.iter_mut().enumerate() {
                *noise = median(&mut fits.iter().map(|(_, sd)| sd[c]).collect::<Vec<_>>());
            }
        }
        let learned = |i: usize| {
            let (mean, sd) = filter.prior(i);
            (filter.seed(i), mean, sd)
        };
        Ok(LearnedPriors { laws: indices.into_iter().map(learned).collect(), noise })
    }

    /// Learned priors as (unknown quantity, mean, standard deviation).
    pub fn normal_priors(&self) -> &[(Seed, f64, f64)] {
        &self.laws
    }

    /// Learned standard deviation of the measurement noise of each channel, in its unit.
    pub fn noise(&self) -> &[f64] {
        &self.noise
    }
}
