//! How good any prediction from the first state can be when the restitution is random and unseen.
//!
//! For each true trajectory an ensemble is drawn from the law given its start. From the ensemble
//! follow the best predictors of each loss, which nothing that sees only the start can beat on
//! average: the median at each time minimises the mean absolute error, the median weighted by
//! 1 / sum |height| minimises trans %, the mean minimises the squared error. A model that instead
//! answers with samples is judged by the continuous ranked probability score, whose best value is
//! that of the exact law.

use super::bullet::BulletState;
pub use super::ensemble::Ensemble;
use super::order_statistics::{median, partition_at_middle, weighted_median};
use super::paper_law::{PaperLaw, check_rate};
use super::score::{BallScore, Estimate, Observation, ScoreError, TrajectoryError, observations};
use augsim_data::{Dataset, random_stream};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use serde::Serialize;

/// How to estimate the floor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FloorOptions {
    /// Draws for each trajectory. The median of 2000 costs 0.1 % more than that of the law.
    pub draws: usize,
    /// Draws that "mean of k samples" averages (10 in the published protocol).
    pub averaged: usize,
    /// Seed; each trajectory has its own stream.
    pub seed: u64,
}

impl Default for FloorOptions {
    fn default() -> Self {
        FloorOptions { draws: 2000, averaged: 10, seed: 0 }
    }
}

/// Scores of the predictors that know the law and the start of each trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Floor {
    /// Median at each time: least position and velocity error.
    pub median: BallScore,
    /// Height: median weighted by 1 / sum |height|, the least trans %. Velocity: plain median.
    pub weighted_median: BallScore,
    /// Mean at each time: least squared error.
    pub mean: BallScore,
    /// Mean of `averaged` draws, averaged over disjoint sets of them.
    pub mean_of_samples: BallScore,
    /// One draw as prediction.
    pub one_sample: BallScore,
    /// Continuous ranked probability score of the exact law in height, m.
    pub crps_height_m: Estimate,
    /// Continuous ranked probability score of the exact law in velocity, m/s.
    pub crps_velocity_m_s: Estimate,
}

/// First sample of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Height of the underside, m.
    pub height_m: f64,
    /// Velocity, m/s.
    pub velocity_m_s: f64,
}

/// Floor of `dataset` under any law: `fill` draws an ensemble for a start from the law.
///
/// Deterministic in the seed, whatever the threads.
///
/// # Errors
/// Missing columns, gaps, heights that are all 0, no trajectories, or too few draws.
pub fn floor<F>(dataset: &Dataset, options: FloorOptions, fill: F) -> Result<Floor, ScoreError>
where
    F: Fn(Start, &mut Xoshiro256PlusPlus, &mut Ensemble) + Sync,
{
    let needed = options.averaged.max(2);
    if options.draws < needed || options.averaged == 0 {
        return Err(ScoreError::TooFewDraws { draws: options.draws, needed });
    }
    let observed = observations(dataset)?;
    let workspace = || (Ensemble::new(options.draws), Workspace::default());
    let scored: Vec<Scored> = observed
        .par_iter()
        .enumerate()
        .map_init(workspace, |(ensemble, workspace), (index, o)| {
            let start = Start { height_m: o.height_m[0], velocity_m_s: o.velocity_m_s[0] };
            let mut rng = random_stream(options.seed, "floor", index as u64);
            ensemble.resize(o.height_m.len());
            fill(start, &mut rng, ensemble);
            score(o, ensemble, options.averaged, workspace)
        })
        .collect();
    let over = |pick: fn(&Scored) -> TrajectoryError| {
        BallScore::from_errors(&scored.iter().map(pick).collect::<Vec<_>>())
    };
    Ok(Floor {
        median: over(|s| s.median),
        weighted_median: over(|s| s.weighted_median),
        mean: over(|s| s.mean),
        mean_of_samples: over(|s| s.mean_of_samples),
        one_sample: over(|s| s.one_sample),
        crps_height_m: Estimate::of(scored.iter().map(|s| s.crps[0])),
        crps_velocity_m_s: Estimate::of(scored.iter().map(|s| s.crps[1])),
    })
}

/// Floor of `dataset` under `law`, whose drop height each trajectory's first sample tells.
///
/// # Errors
/// The errors of [`floor`], and samples that are not the law's steps apart.
pub fn paper_floor(law: &PaperLaw, dataset: &Dataset, options: FloorOptions) -> Result<Floor, ScoreError> {
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

/// Errors of one trajectory under each predictor.
struct Scored {
    median: TrajectoryError,
    weighted_median: TrajectoryError,
    mean: TrajectoryError,
    mean_of_samples: TrajectoryError,
    one_sample: TrajectoryError,
    /// Height m, velocity m/s.
    crps: [f64; 2],
}

#[derive(Default)]
struct Workspace {
    keys: Vec<u64>,
    weights: Vec<f64>,
}

fn score(o: &Observation<'_>, ensemble: &Ensemble, averaged: usize, w: &mut Workspace) -> Scored {
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

/// 1 / sum over time of |height|, of each draw. A draw that lies at exactly 0 throughout would weigh
/// infinitely much; it is given the weight of a micrometre instead.
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

/// Sums over time of the absolute errors of each predictor, and of the score.
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
    /// Adds one time: `truth` against the draws there.
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
        // E|X - y| - E|X - X'| / 2 with each draw paired with the next instead of all others: as fair
        // (unbiased from any number of draws, Ferro 2014) as over all pairs, and needs no sorting.
        self.crps += one_sample - pairs / (2.0 * count);
    }
}

/// Sum of `term` over pairs, in eight interleaved partial sums, which vector code can keep apart.
fn sum(a: &[f32], b: &[f32], term: impl Fn(f64, f64) -> f64) -> f64 {
    let mut partial = [0.0_f64; 8];
    let (a_chunks, b_chunks) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest = a_chunks.remainder().len();
    let tail = a.len() - rest;
    for (x, y) in a_chunks.zip(b_chunks) {
        for lane in 0..8 {
            partial[lane] += term(x[lane].into(), y[lane].into());
        }
    }
    let tails = a[tail..].iter().zip(&b[tail..]);
    partial.iter().sum::<f64>() + tails.map(|(&x, &y)| term(x.into(), y.into())).sum::<f64>()
}
