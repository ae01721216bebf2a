//! Draws from the posterior of a trajectory's unknowns, by tempered sequential Monte Carlo.
//!
//! The sampler (Del Moral, Doucet, Jasra 2006) moves particles through the densities
//!
//! ```text
//! (1)  q^(1 - b) p^b,    b from 0 to 1,
//! ```
//!
//! with posterior p and a Gaussian q at the mode that is a little wider than the curvature says. Moves are
//! preconditioned Crank-Nicolson steps. Where p is Gaussian, one tempering step is enough.

use super::inference_problem::InferenceProblem;
use super::mode::Mode;
use super::moments::weighted;
use super::weights::{effective_size, largest_increment, resample, shares};
use crate::latent::{cholesky, whiten};
use augsim_system::Simulated;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Standard deviation of the proposal q in formula (1), relative to that of the curvature at the mode.
const PROPOSAL_WIDTH: f64 = 1.1;
/// Minimum effective sample size after one tempering step, as a share of the particles.
const MIN_EFFECTIVE_SHARE: f64 = 0.5;
/// Maximum number of tempering steps; the last one always reaches exponent b = 1.
const MAX_TEMPERING_STEPS: usize = 12;
/// Number of Metropolis steps of every particle after a tempering step that did not reach exponent b = 1.
const MOVES: usize = 3;
/// Size of a Metropolis move: a Crank-Nicolson step keeps sqrt(1 - MOVE_SIZE^2) of the old value.
const MOVE_SIZE: f64 = 0.6;

/// Log density of impossible values of the unknowns; finite, so that any multiple of it is finite.
const MIN_LOG_DENSITY: f64 = -1e300;

/// Draws `count` particles `[count, U]` from the posterior of U unknowns; returns them and their log weights.
pub(super) fn posterior(
    problem: &InferenceProblem<'_>,
    mode: &Mode,
    count: usize,
    rng: &mut Xoshiro256PlusPlus,
) -> (Vec<f64>, Vec<f64>) {
    let (width, rows) = (mode.values.len(), problem.observed_rows());
    let mut simulated = Simulated::default();
    let factor: Vec<f64> = cholesky(&mode.covariance, width).iter().map(|v| PROPOSAL_WIDTH * v).collect();
    let half_square = |white: &[f64]| 0.5 * white.iter().map(|v| v * v).sum::<f64>();
    // Log ratio of posterior and proposal density, up to a constant.
    let log_ratio = |values: &[f64], simulated: &mut Simulated| {
        (mode.cost - problem.negative_log_posterior(values, rows, simulated)
            + half_square(&whiten(values, &mode.values, &factor)))
        .max(MIN_LOG_DENSITY)
    };
    let from_white = |white: &[f64], mean: &[f64], factor: &[f64]| -> Vec<f64> {
        let shift = |i: usize| (0..=i).map(|k| factor[i * width + k] * white[k]).sum::<f64>();
        (0..width).map(|i| mean[i] + shift(i)).collect()
    };
    let mut particles = Vec::with_capacity(count * width);
    for _ in 0..count {
        let white: Vec<f64> = (0..width).map(|_| StandardNormal.sample(rng)).collect();
        particles.extend(from_white(&white, &mode.values, &factor));
    }
    let mut log_ratios: Vec<f64> =
        particles.chunks_exact(width.max(1)).map(|values| log_ratio(values, &mut simulated)).collect();
    log_ratios.resize(count, 0.0);
    let mut exponent = 0.0;
    for tempering_step in 1.. {
        let remaining = 1.0 - exponent;
        let scaled_ratios = |increment: f64| log_ratios.iter().map(|v| increment * v).collect::<Vec<f64>>();
        let increment = if tempering_step < MAX_TEMPERING_STEPS {
            largest_increment(
                |increment| effective_size(&scaled_ratios(increment)),
                remaining,
                MIN_EFFECTIVE_SHARE * count as f64,
            )
        } else {
            remaining
        };
        let weights = scaled_ratios(increment);
        exponent += increment;
        if increment == remaining {
            return (particles, weights);
        }
        let cloud = weighted(&particles, &shares(&weights), width);
        let chosen = resample(&weights, count, rng);
        particles =
            chosen.iter().flat_map(|&i| particles[i * width..(i + 1) * width].iter().copied()).collect();
        log_ratios = chosen.iter().map(|&i| log_ratios[i]).collect();
        let local_factor = cholesky(&cloud.covariance, width);
        for _ in 0..MOVES {
            for i in 0..count {
                let values = &particles[i * width..(i + 1) * width];
                let white = whiten(values, &cloud.mean, &local_factor);
                let moved: Vec<f64> = (white.iter())
                    .map(|v| {
                        let draw: f64 = StandardNormal.sample(rng);
                        (1.0 - MOVE_SIZE * MOVE_SIZE).sqrt() * v + MOVE_SIZE * draw
                    })
                    .collect();
                let proposed = from_white(&moved, &cloud.mean, &local_factor);
                let proposed_ratio = log_ratio(&proposed, &mut simulated);
                // The tempered log density (1) is ln q plus the exponent times the log ratio.
                let density = |values: &[f64], log_ratio: f64| {
                    exponent * log_ratio - half_square(&whiten(values, &mode.values, &factor))
                };
                let ratio = half_square(&moved) - half_square(&white) + density(&proposed, proposed_ratio)
                    - density(values, log_ratios[i]);
                let draw: f64 = rng.random();
                if proposed_ratio > MIN_LOG_DENSITY && draw.ln() < ratio {
                    particles[i * width..(i + 1) * width].copy_from_slice(&proposed);
                    log_ratios[i] = proposed_ratio;
                }
            }
        }
    }
    (particles, log_ratios)
}
