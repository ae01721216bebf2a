//! Error floor: the smallest possible prediction error when the restitution is random and unknown.
//!
//! For each true trajectory an ensemble is drawn from the data distribution, given the initial state. The
//! optimal predictors follow from the ensemble; no model that knows only the initial state has a smaller
//! error on average:
//!
//! 1. the median at each time minimises the mean absolute error,
//! 2. the median weighted by 1 / sum |height| minimises trans %,
//! 3. the mean minimises the squared error.
//!
//! Models that predict distributions are scored by the continuous ranked probability score (CRPS),
//! CRPS = E|X - y| - E|X - X'| / 2, which is smallest for the exact distribution.

use super::bullet::BulletState;
use super::drop_distribution::{DropDistribution, check_rate};
pub use super::ensemble::Ensemble;
use super::order_statistics::{median, partition_at_middle, weighted_median};
use super::score::{BallScore, Estimate, Observation, ScoreError, TrajectoryError, observations};
use augsim_data::{Dataset, random_stream};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use serde::Serialize;

/// Settings of the estimate of the error floor, the smallest possible prediction error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ErrorFloorOptions {
    /// Draws per trajectory. The median of 2000 draws has a 0.1 % larger error than the exact median.
    pub draws: usize,
    /// Number of draws that the predictor "mean of k samples" averages: k, 10 in the published protocol.
    pub averaged: usize,
    /// Seed of the draws; each trajectory has its own random stream.
    pub seed: u64,
}

impl Default for ErrorFloorOptions {
    fn default() -> Self {
        ErrorFloorOptions { draws: 2000, averaged: 10, seed: 0 }
    }
}

/// Scores of the best possible predictors, which know data distribution and initial states.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Floor {
    /// Scores of the median at each time, which minimises the mean absolute errors.
    pub median: BallScore,
    /// Scores of the median weighted by 1 / sum |height| (minimises trans %); velocity: unweighted median.
    pub weighted_median: BallScore,
    /// Scores of the mean at each time, which minimises the squared error.
    pub mean: BallScore,
    /// Scores of the mean of `averaged` draws; the error is averaged over disjoint sets of draws.
    pub mean_of_samples: BallScore,
    /// Scores of one draw as prediction; the error is averaged over all draws.
    pub one_sample: BallScore,
    /// CRPS of the exact distribution as predictor of the height, m.
    pub crps_height_m: Estimate,
    /// CRPS of the exact distribution as predictor of the velocity, m/s.
    pub crps_velocity_m_s: Estimate,
}

/// Initial state of a trajectory, from which an ensemble is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Initial height of the ball's underside, m.
    pub height_m: f64,
    /// Initial vertical velocity, m/s.
    pub velocity_m_s: f64,
}

/// Smallest possible prediction errors on `dataset`; `fill` draws an ensemble for an initial state.
///
/// The result depends on the seed, not on the number of threads.
///
/// # Errors
/// [`ScoreError`] for missing columns, gaps, heights that are all 0, no trajectories, or too few draws.
pub fn floor<F>(dataset: &Dataset, options: ErrorFloorOptions, fill: F) -> Result<Floor, ScoreError>
where
    F: Fn(Start, &mut Xoshiro256PlusPlus, &mut Ensemble) + Sync,
{
    let needed = options.averaged.max(2);
    if options.draws < needed || options.averaged == 0 {
        return Err(ScoreError::TooFewDraws { draws: options.draws, needed });
    }
    let observed = observations(dataset)?;
    let buffers = || (Ensemble::new(options.draws), Buffers::default());
    let scored: Vec<Scored> = observed
        .par_iter()
        .enumerate()
        .map_init(buffers, |(ensemble, buffers), (index, o)| {
            let start = Start { height_m: o.height_m[0], velocity_m_s: o.velocity_m_s[0] };
            let mut rng = random_stream(options.seed, "floor", index as u64);
            ensemble.resize(o.height_m.len());
            fill(start, &mut rng, ensemble);
            score(o, ensemble, options.averaged, buffers)
        })
        .collect();
    let score_of = |pick: fn(&Scored) -> TrajectoryError| {
        BallScore::from_errors(&scored.iter().map(pick).collect::<Vec<_>>())
    };
    Ok(Floor {
        median: score_of(|s| s.median),
        weighted_median: score_of(|s| s.weighted_median),
        mean: score_of(|s| s.mean),
        mean_of_samples: score_of(|s| s.mean_of_samples),
        one_sample: score_of(|s| s.one_sample),
        crps_height_m: Estimate::from_values(scored.iter().map(|s| s.crps[0])),
        crps_velocity_m_s: Estimate::from_values(scored.iter().map(|s| s.crps[1])),
    })
}

/// Smallest possible prediction errors on `dataset` if its data follow the distribution `law`.
///
/// The drop height is that of each trajectory's first sample.
///
/// # Errors
/// Those of [`floor`], and [`ScoreError::OtherRate`] if samples are not at the steps of the law.
pub fn published_error_floor(
    law: &DropDistribution,
    dataset: &Dataset,
    options: ErrorFloorOptions,
) -> Result<Floor, ScoreError> {
    check_rate(dataset, law.ball.step_s)?;
    floor(dataset, options, |start, rng, ensemble| {
        let radius = law.ball.radius_m;
        let first = BulletState { centre_m: start.height_m + radius, velocity_m_s: start.velocity_m_s };
        let restitution: Vec<f64> = (0..ensemble.draws()).map(|_| law.draw_restitution(rng)).collect();
        let mut centre = vec![first.centre_m; restitution.len()];
        let mut velocity = vec![first.velocity_m_s; restitution.len()];
        for t in 0..ensemble.samples() {
            if t > 0 {
                for ((&e, z), v) in restitution.iter().zip(&mut centre).zip(&mut velocity) {
                    let mut state = BulletState { centre_m: *z, velocity_m_s: *v };
                    law.ball.step_with(e, &mut state);
                    (*z, *v) = (state.centre_m, state.velocity_m_s);
                }
            }
            let (heights, velocities) = ensemble.at_mut(t);
            heights.iter_mut().zip(&centre).for_each(|(h, z)| *h = (z - radius) as f32);
            velocities.iter_mut().zip(&velocity).for_each(|(to, v)| *to = *v as f32);
        }
    })
}

/// Errors of each predictor on one trajectory.
struct Scored {
    median: TrajectoryError,
    weighted_median: TrajectoryError,
    mean: TrajectoryError,
    mean_of_samples: TrajectoryError,
    one_sample: TrajectoryError,
    /// CRPS of the height, m, and of the velocity, m/s.
    crps: [f64; 2],
}

/// Buffers of [`score`] that are reused between trajectories.
#[derive(Default)]
struct Buffers {
    keys: Vec<u64>,
    weights: Vec<f64>,
}

/// Errors of each predictor on the trajectory `o`, from an ensemble with the same initial state.
fn score(o: &Observation<'_>, ensemble: &Ensemble, averaged: usize, w: &mut Buffers) -> Scored {
    fill_weights(ensemble, &mut w.weights);
    let mut height = Sums::default();
    let mut velocity = Sums::default();
    for (t, (&h, &v)) in o.height_m.iter().zip(o.velocity_m_s).enumerate() {
        height.add(h, ensemble.height_at(t), averaged, Some(&w.weights), &mut w.keys);
        velocity.add(v, ensemble.velocity_at(t), averaged, None, &mut w.keys);
    }
    let samples = o.height_m.len() as f64;
    Scored {
        median: o.error_from_sums(height.median, velocity.median),
        weighted_median: o.error_from_sums(height.weighted_median, velocity.median),
        mean: o.error_from_sums(height.mean, velocity.mean),
        mean_of_samples: o.error_from_sums(height.mean_of_samples, velocity.mean_of_samples),
        one_sample: o.error_from_sums(height.one_sample, velocity.one_sample),
        crps: [height.crps / samples, velocity.crps / samples],
    }
}

/// Computes the weight of each draw: 1 / sum over time of |height|.
///
/// The sum is limited to at least 1e-6 m, so that a draw that is always at height 0 has a finite weight.
fn fill_weights(ensemble: &Ensemble, weights: &mut Vec<f64>) {
    weights.clear();
    weights.resize(ensemble.draws(), 0.0);
    for t in 0..ensemble.samples() {
        for (weight, &h) in weights.iter_mut().zip(ensemble.height_at(t)) {
            *weight += f64::from(h.abs());
        }
    }
    weights.iter_mut().for_each(|sum| *sum = 1.0 / sum.max(1e-6));
}

/// Sums over time of the absolute error of each predictor, and of the CRPS.
#[derive(Default)]
struct Sums {
    median: f64,
    weighted_median: f64,
    mean: f64,
    mean_of_samples: f64,
    one_sample: f64,
    crps: f64,
}

impl Sums {
    /// Adds the errors at one time, given the true value and the draws at that time.
    fn add(
        &mut self,
        truth: f64,
        draws: &[f32],
        averaged: usize,
        weights: Option<&[f64]>,
        keys: &mut Vec<u64>,
    ) {
        let count = draws.len() as f64;
        let one_sample = sum(draws, draws, |x, _| (x - truth).abs()) / count;
        let mean = sum(draws, draws, |x, _| x) / count;
        let sets = draws.chunks_exact(averaged);
        let set_count = sets.len() as f64;
        let set_error = |set: &[f32]| {
            let total: f64 = set.iter().map(|&x| f64::from(x)).sum();
            (total / averaged as f64 - truth).abs()
        };
        let mean_of_samples = sets.map(set_error).sum::<f64>() / set_count;
        let pairs = sum(&draws[1..], draws, |x, y| (x - y).abs())
            + f64::from((draws[0] - draws[draws.len() - 1]).abs());

        let middle = partition_at_middle(draws, keys);
        let median = median(keys, middle);
        if let Some(weights) = weights {
            self.weighted_median += (weighted_median(keys, middle, weights) - truth).abs();
        }
        self.median += (median - truth).abs();
        self.mean += (mean - truth).abs();
        self.mean_of_samples += mean_of_samples;
        self.one_sample += one_sample;
        // E|X - y| - E|X - X'| / 2, with each draw paired with the next one instead of all others. This is
        // unbiased for any number of draws (fair in the sense of Ferro 2014), like the average over all
        // pairs, and needs no sorting.
        self.crps += one_sample - pairs / (2.0 * count);
    }
}

/// Sum of `term(a[i], b[i])`, in eight interleaved partial sums for vectorisation.
fn sum(a: &[f32], b: &[f32], term: impl Fn(f64, f64) -> f64) -> f64 {
    let mut partial = [0.0_f64; 8];
    let (a_chunks, b_chunks) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail = a.len() - a_chunks.remainder().len();
    for (x, y) in a_chunks.zip(b_chunks) {
        for lane in 0..8 {
            partial[lane] += term(x[lane].into(), y[lane].into());
        }
    }
    let tails = a[tail..].iter().zip(&b[tail..]);
    partial.iter().sum::<f64>() + tails.map(|(&x, &y)| term(x.into(), y.into())).sum::<f64>()
}
