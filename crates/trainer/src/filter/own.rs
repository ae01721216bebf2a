//! Laws of what differs from trajectory to trajectory, learned from whole trajectories.
//!
//! Each trajectory is fitted under the laws so far (the mode and the curvature there); the next law of a number has the mean of
//! its modes, and for its variance their mean square with that of the curvature (expectation and maximisation: Dempster, Laird,
//! Rubin 1977). What trajectories do not tell apart shrinks to one value, what they do not show keeps its law.

use super::behind::Prefix;
use super::system::SystemFilter;
use super::{Sensor, StartLaw};
use crate::{Sequences, TrainerError};
use augsim_physics::statistics::median;
use augsim_physics::system::Seed;
use rayon::prelude::*;

/// Rounds; what is shown well settles in three, and what only some trajectories show in about ten.
const ROUNDS: usize = 12;
/// Squared distances from the mean, in variances of the present law, count at most so much: a ball that hit the net does not
/// widen the law of all others.
const MOST: f64 = 9.0;
/// A law never becomes narrower than this share of the deviation that it began with.
const NARROWEST: f64 = 1e-3;

/// Means and standard deviations of what differs from trajectory to trajectory, and of the noise of each channel.
#[derive(Debug, Clone, PartialEq)]
pub struct OwnLaws {
    laws: Vec<(Seed, f64, f64)>,
    noise: Vec<f64>,
}

impl OwnLaws {
    /// Learns the laws of all parameters that `filter` draws for each trajectory from the whole trajectories `train`, for whose
    /// records it was made.
    ///
    /// # Errors
    /// [`TrainerError`] if no trajectory can be fitted.
    pub fn learn(filter: &SystemFilter, train: &Sequences) -> Result<Self, TrainerError> {
        let mut filter = filter.clone();
        let channels = train.state_dim();
        let sensor = Sensor::exact(channels);
        let start = StartLaw { mean: Vec::new(), sd: Vec::new() };
        let places = filter.own_places();
        let least: Vec<f64> = places.iter().map(|&i| NARROWEST * filter.law(i).1).collect();
        let mut noise = vec![0.0; channels];
        for _ in 0..ROUNDS {
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
                    filter.own_fit(&prefix, &places).ok()
                })
                .collect();
            if fits.is_empty() {
                return Err(TrainerError::NoTrajectories { what: "the training set, where each is fitted," });
            }
            let count = fits.len() as f64;
            for (k, &place) in places.iter().enumerate() {
                let (_, sd) = filter.law(place);
                let mean = median(&mut fits.iter().map(|(own, _)| own[k][0]).collect::<Vec<_>>());
                let square = |own: &[[f64; 2]]| ((own[k][0] - mean).powi(2) + own[k][1]).min(MOST * sd * sd);
                let variance = fits.iter().map(|(own, _)| square(own)).sum::<f64>() / count;
                filter.set_law(place, (mean, variance.sqrt().max(least[k])));
            }
            for (c, noise) in noise.iter_mut().enumerate() {
                *noise = median(&mut fits.iter().map(|(_, sd)| sd[c]).collect::<Vec<_>>());
            }
        }
        let law = |i: usize| {
            let (mean, sd) = filter.law(i);
            (filter.seed(i), mean, sd)
        };
        Ok(OwnLaws { laws: places.into_iter().map(law).collect(), noise })
    }

    /// Each number with its mean and standard deviation.
    pub fn laws(&self) -> &[(Seed, f64, f64)] {
        &self.laws
    }

    /// Noise of each channel, in its unit.
    pub fn noise(&self) -> &[f64] {
        &self.noise
    }
}
