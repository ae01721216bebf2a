//! Possible true parameters: draws from their distribution after all recordings, by importance resampling.
//!
//! With the likelihood P_r(ξ) of recording r by simulation, its initial state integrated out by formula (3) of `reduced.rs`, and the prior
//! N(0, I) of the coordinates ξ, which is as wide as the bounds, or as 3 standard errors of the fit without them, the density of ξ after the recordings is
//!
//! ```text
//! (1)  π(ξ) = Π P_r(ξ) N(ξ; 0, I) / constant,     0 outside the bounds
//! ```
//!
//! It need not be about normal: recordings may leave parameters on a curve, or at a bound. Candidates are drawn in rounds
//! (population Monte Carlo: Cappé, Guillin, Marin and Robert 2004). The first round has kernels at the maxima of
//! Π L_r(ξ) N(ξ; ξ₀, I) for centres ξ₀ that are drawn from the prior (randomised maximum likelihood: Oliver, He and Reynolds
//! 1996), which are all over the distribution; later ones have kernels at candidates that are resampled by their weights. A
//! kernel has the curvature of π at its centre:
//!
//! ```text
//! (2)  kernel at ξ_c:  N(ξ_c, s² (I + Σ A_r(ξ_c))⁻¹)
//! (3)  weight  w(ξ) = π(ξ) / mean of all kernels of all rounds at ξ        (Owen and Zhou 2000; Cornuet et al. 2012)
//! (4)  effective number  (Σ w)² / Σ w²                                      (Kong 1992)
//! ```
//!
//! Rounds end once the effective number is sufficient.

use crate::draw::draw_values;
use crate::error::DesignError;
use crate::evidence::Evidence;
use crate::explanation::{Explanation, factor_of};
use crate::joint::Joint;
use crate::projection::inverse_with_prior;
use crate::verdict::log_sum;
use augsim_data::random_stream;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Number of kernel centres of a later round.
const CENTRES: usize = 64;
/// Widths s of the kernels at each centre: curved densities are followed by the narrow ones.
const WIDTHS: [f64; 3] = [1.0, 0.3, 0.1];
/// Number of candidates of a round: one for each kernel.
const CANDIDATES: usize = CENTRES * WIDTHS.len();
/// Effective number of candidates from which the rounds end: as many as a promise has sequences.
const SUFFICIENT: f64 = 200.0;
/// Minimum number of rounds: where the first one has only little of the distribution, its effective number may be large by chance.
const MIN_ROUNDS: usize = 3;
/// Maximum number of rounds.
const MAX_ROUNDS: usize = 10;

/// Weighted draws from the distribution of an explanation's parameters.
#[derive(Clone, Debug)]
pub struct PosteriorSample {
    /// The explanation after the recordings, whose normal distribution is drawn from where there are no candidates.
    explanation: Explanation,
    /// Values of all parameters of each candidate.
    values: Vec<Vec<f64>>,
    /// Sums of the weights up to each candidate; the last one is 1.
    cumulative: Vec<f64>,
    effective: f64,
}

impl PosteriorSample {
    /// Draws from the normal distribution of the explanation's coordinates.
    pub fn normal(explanation: &Explanation) -> Self {
        let explanation = explanation.clone();
        Self { explanation, values: Vec::new(), cumulative: Vec::new(), effective: f64::INFINITY }
    }

    /// Draws from the distribution (1) after all recordings of `evidence`; `index` numbers the explanation.
    ///
    /// Without recordings, or with no candidate that can be simulated, the draws are those of [`PosteriorSample::normal`].
    ///
    /// # Errors
    /// A recording cannot be simulated at the fitted values.
    pub fn new(evidence: &Evidence, seed: u64, index: u64) -> Result<Self, DesignError> {
        let explanation = evidence.updated();
        let joint = evidence.all_recordings()?;
        if joint.count() == 0 || explanation.uncertain.is_empty() {
            return Ok(Self::normal(&explanation));
        }
        let mut rng = random_stream(seed, "posterior", index);
        let mut population = Population::new(&joint);
        for round in 1..=MAX_ROUNDS {
            population.add_round(&mut rng);
            let is_sufficient = round >= MIN_ROUNDS && population.effective() >= SUFFICIENT;
            if is_sufficient || population.candidates.is_empty() {
                break;
            }
        }
        let sum = |sum: &mut f64, w: &f64| {
            *sum += w;
            Some(*sum)
        };
        Ok(Self {
            values: population.candidates.iter().map(|c| joint.prior.values_at(&c.xi)).collect(),
            cumulative: population.weights.iter().scan(0.0, sum).collect(),
            effective: population.effective(),
            explanation,
        })
    }

    /// Draws values of all parameters.
    pub fn draw(&self, rng: &mut impl Rng) -> Vec<f64> {
        if self.values.is_empty() {
            return draw_values(&self.explanation, rng);
        }
        let share: f64 = rng.random();
        let place = self.cumulative.partition_point(|sum| *sum <= share);
        self.values[place.min(self.values.len() - 1)].clone()
    }

    /// Effective number (4) of independent draws; infinite for a normal distribution.
    pub fn effective_number(&self) -> f64 {
        self.effective
    }
}

/// A candidate within the bounds that can be simulated.
struct Candidate {
    xi: Vec<f64>,
    /// Logarithm of π, up to a constant.
    log_density: f64,
    /// Information Σ A_r of the recordings there.
    information: Vec<Vec<f64>>,
}

/// A normal kernel (2).
#[derive(Clone)]
struct Kernel {
    centre: Vec<f64>,
    /// Inverse covariance.
    precision: Vec<Vec<f64>>,
    /// Lower factor of the covariance.
    factor: Vec<Vec<f64>>,
    /// Logarithm of the density at the centre, without the power of 2π.
    log_peak: f64,
}

impl Kernel {
    /// A kernel of width `s` with the information `a`; `None` if I + A is not positive definite.
    fn new(centre: &[f64], a: &[Vec<f64>], s: f64) -> Option<Self> {
        let n = centre.len();
        let inverted = inverse_with_prior(n, 1.0, |i, j| a[i][j])?;
        let covariance: Vec<Vec<f64>> =
            (0..n).map(|i| (0..n).map(|j| s * s * inverted.inverse[(i, j)]).collect()).collect();
        let entry = |i: usize, j: usize| (a[i][j] + if i == j { 1.0 } else { 0.0 }) / (s * s);
        Some(Self {
            centre: centre.to_vec(),
            precision: (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect(),
            factor: factor_of(&covariance),
            log_peak: inverted.half_log_determinant - n as f64 * s.ln(),
        })
    }

    fn draw(&self, rng: &mut impl Rng) -> Vec<f64> {
        let z: Vec<f64> = self.centre.iter().map(|_| StandardNormal.sample(&mut *rng)).collect();
        let moved =
            |(centre, row): (&f64, &Vec<f64>)| centre + row.iter().zip(&z).map(|(l, z)| l * z).sum::<f64>();
        self.centre.iter().zip(&self.factor).map(moved).collect()
    }

    /// Logarithm of the density, without the power of 2π.
    fn log_density(&self, xi: &[f64]) -> f64 {
        let d: Vec<f64> = xi.iter().zip(&self.centre).map(|(xi, centre)| xi - centre).collect();
        let along = |row: &Vec<f64>| row.iter().zip(&d).map(|(p, d)| p * d).sum::<f64>();
        let square: f64 = self.precision.iter().zip(&d).map(|(row, d)| d * along(row)).sum();
        self.log_peak - 0.5 * square
    }
}

/// Candidates of all rounds with their weights.
struct Population<'a> {
    joint: &'a Joint,
    candidates: Vec<Candidate>,
    /// Sum of all kernels of all rounds at each candidate; each round has equally many draws.
    kernel_sums: Vec<f64>,
    kernels: Vec<Kernel>,
    /// Normalised weights.
    weights: Vec<f64>,
}

impl<'a> Population<'a> {
    fn new(joint: &'a Joint) -> Self {
        let (candidates, kernel_sums) = (Vec::new(), Vec::new());
        Self { joint, candidates, kernel_sums, kernels: Vec::new(), weights: Vec::new() }
    }

    /// Draws one candidate from each kernel of a new round, and computes all weights anew.
    fn add_round(&mut self, rng: &mut impl Rng) {
        let new =
            if self.weights.is_empty() { self.first_kernels(rng) } else { self.kernels_at_candidates(rng) };
        let drawn: Vec<Vec<f64>> = new.iter().map(|kernel| kernel.draw(rng)).collect();
        let joint = self.joint;
        let candidate = |xi: Vec<f64>| -> Option<Candidate> {
            if !joint.prior.is_within_bounds(&xi) {
                return None;
            }
            let there = joint.moved_to(&xi)?;
            let log_density = there.log_posterior();
            let information = there.later_information().to_vec();
            log_density.is_finite().then_some(Candidate { xi, log_density, information })
        };
        let found: Vec<Candidate> = drawn.into_par_iter().filter_map(candidate).collect();
        for (candidate, sum) in self.candidates.iter().zip(&mut self.kernel_sums) {
            *sum += sum_at(&new, &candidate.xi);
        }
        self.kernels.extend(new);
        self.kernel_sums.extend(found.iter().map(|candidate| sum_at(&self.kernels, &candidate.xi)));
        self.candidates.extend(found);
        self.weigh();
    }

    /// Kernels of the first round: at maxima of the density that priors about drawn centres leave.
    fn first_kernels(&self, rng: &mut impl Rng) -> Vec<Kernel> {
        let joint = self.joint;
        let centres: Vec<Vec<f64>> = (1..CENTRES)
            .map(|_| joint.xi().iter().map(|_| StandardNormal.sample(&mut *rng)).collect())
            .collect();
        let kernels = |xi: &[f64], information: &[Vec<f64>]| -> Vec<Kernel> {
            WIDTHS.iter().filter_map(|width| Kernel::new(xi, information, *width)).collect()
        };
        let pulled = |centre: &Vec<f64>| -> Option<Vec<Kernel>> {
            let there = joint.pulled_to(centre)?;
            let xi: Vec<f64> = centre.iter().zip(there.xi()).map(|(a, b)| a + b).collect();
            Some(kernels(&xi, there.later_information()))
        };
        let all: Vec<Vec<Kernel>> = centres.par_iter().filter_map(pulled).collect();
        all.into_iter().flatten().chain(kernels(joint.xi(), joint.later_information())).collect()
    }

    /// Kernels at candidates that are resampled by their weights (systematic resampling).
    fn kernels_at_candidates(&self, rng: &mut impl Rng) -> Vec<Kernel> {
        let (first, mut sum, mut place): (f64, f64, usize) = (rng.random(), self.weights[0], 0);
        let mut kernels = Vec::with_capacity(CANDIDATES);
        for k in 0..CENTRES {
            while sum < (k as f64 + first) / CENTRES as f64 && place + 1 < self.weights.len() {
                place += 1;
                sum += self.weights[place];
            }
            let Candidate { xi, information, .. } = &self.candidates[place];
            kernels.extend(WIDTHS.iter().filter_map(|width| Kernel::new(xi, information, *width)));
        }
        kernels
    }

    /// Normalised weights (3).
    fn weigh(&mut self) {
        let log = |(c, sum): (&Candidate, &f64)| c.log_density - sum.ln();
        let logs: Vec<f64> = self.candidates.iter().zip(&self.kernel_sums).map(log).collect();
        let norm = log_sum(logs.iter().copied());
        self.weights = logs.iter().map(|log| (log - norm).exp()).collect();
    }

    /// Effective number (4); 0 without candidates.
    fn effective(&self) -> f64 {
        let squares: f64 = self.weights.iter().map(|w| w * w).sum();
        if squares > 0.0 { 1.0 / squares } else { 0.0 }
    }
}

/// Sum of kernels at a point.
fn sum_at(kernels: &[Kernel], xi: &[f64]) -> f64 {
    kernels.iter().map(|kernel| kernel.log_density(xi).exp()).sum()
}
