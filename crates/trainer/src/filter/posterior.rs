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

use super::case::Case;
use super::mode::Mode;
use super::moments::weighted;
use super::weights::{effective, shares, systematic};
use crate::latent::{cholesky, whiten};
use augsim_physics::system::Simulated;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Standard deviation of q relative to that of the curvature.
const WIDER: f64 = 1.1;
/// Effective share of the particles that one tempering step must leave.
const ENOUGH: f64 = 0.5;
/// Maximum number of tempering steps; the last one always reaches b = 1.
const MOST_DEGREES: usize = 12;
/// Metropolis steps of every particle after a tempering step that did not reach b = 1.
const MOVES: usize = 3;
/// Size of a preconditioned Crank-Nicolson move.
const MOVE: f64 = 0.6;

/// Log density of impossible values; finite, so that any multiple of it is finite.
const NEVER: f64 = -1e300;

/// Draws `count` particles `[count, U]` and returns them with their log weights.
pub(super) fn posterior(
    case: &Case<'_>,
    mode: &Mode,
    count: usize,
    rng: &mut Xoshiro256PlusPlus,
) -> (Vec<f64>, Vec<f64>) {
    let (width, n) = (mode.at.len(), case.seen());
    let mut out = Simulated::default();
    let factor: Vec<f64> = cholesky(&mode.covariance, width).iter().map(|v| WIDER * v).collect();
    let half_square = |white: &[f64]| 0.5 * white.iter().map(|v| v * v).sum::<f64>();
    // Log ratio of posterior and proposal density, up to a constant.
    let excess = |at: &[f64], out: &mut Simulated| {
        (mode.cost - case.cost(at, n, out) + half_square(&whiten(at, &mode.at, &factor))).max(NEVER)
    };
    let place = |white: &[f64], centre: &[f64], factor: &[f64]| -> Vec<f64> {
        let shift = |i: usize| (0..=i).map(|k| factor[i * width + k] * white[k]).sum::<f64>();
        (0..width).map(|i| centre[i] + shift(i)).collect()
    };
    let mut particles = Vec::with_capacity(count * width);
    for _ in 0..count {
        let white: Vec<f64> = (0..width).map(|_| StandardNormal.sample(rng)).collect();
        particles.extend(place(&white, &mode.at, &factor));
    }
    let mut over: Vec<f64> = particles.chunks_exact(width.max(1)).map(|at| excess(at, &mut out)).collect();
    over.resize(count, 0.0);
    let mut taken = 0.0;
    for degree in 1.. {
        let rest = 1.0 - taken;
        let scaled = |part: f64| over.iter().map(|v| part * v).collect::<Vec<f64>>();
        let part = if degree < MOST_DEGREES { share(&scaled, rest, ENOUGH * count as f64) } else { rest };
        let weights = scaled(part);
        taken += part;
        if part == rest {
            return (particles, weights);
        }
        let cloud = weighted(&particles, &shares(&weights), width);
        let chosen = systematic(&weights, count, rng);
        particles =
            chosen.iter().flat_map(|&i| particles[i * width..(i + 1) * width].iter().copied()).collect();
        over = chosen.iter().map(|&i| over[i]).collect();
        let local = cholesky(&cloud.covariance, width);
        for _ in 0..MOVES {
            for i in 0..count {
                let at = &particles[i * width..(i + 1) * width];
                let white = whiten(at, &cloud.mean, &local);
                let moved: Vec<f64> = (white.iter())
                    .map(|v| {
                        let draw: f64 = StandardNormal.sample(rng);
                        (1.0 - MOVE * MOVE).sqrt() * v + MOVE * draw
                    })
                    .collect();
                let to = place(&moved, &cloud.mean, &local);
                let next = excess(&to, &mut out);
                // The tempered log density (1) is ln q plus the exponent times the log ratio.
                let density =
                    |at: &[f64], over: f64| taken * over - half_square(&whiten(at, &mode.at, &factor));
                let ratio =
                    half_square(&moved) - half_square(&white) + density(&to, next) - density(at, over[i]);
                let draw: f64 = rng.random();
                if next > NEVER && draw.ln() < ratio {
                    particles[i * width..(i + 1) * width].copy_from_slice(&to);
                    over[i] = next;
                }
            }
        }
    }
    (particles, over)
}

/// The largest tempering increment, at most `remaining`, that leaves enough effective particles.
/// Found by bisection.
fn share(scaled: &dyn Fn(f64) -> Vec<f64>, rest: f64, enough: f64) -> f64 {
    let after = |part: f64| effective(&scaled(part));
    if after(rest) >= enough {
        return rest;
    }
    let (mut low, mut high) = (0.0, rest);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if after(middle) >= enough { low = middle } else { high = middle }
    }
    low
}
