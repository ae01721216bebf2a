//! Evidence of new recordings for an explanation: their mixture density and their maximised likelihood.
//!
//! The parameters have the coordinates ξ under the normal distribution N(0, I) that all earlier data leave. With
//! L_r(ξ) the density of the later samples of recording r given its first ones, its initial state integrated out, as in
//! `reduced.rs`,
//!
//! ```text
//! (1)  ln p = ln ∫ Π L_r(ξ) N(ξ; 0, I) dξ  =  ln Π L_r(ξ̂) - 1/2 |ξ̂|² - 1/2 ln |I + Σ A_r|      mixture
//! (2)  1/q  = mean over h of  p_h / max over ξ of { L_h(ξ) Π L_r(ξ) }                          maximised likelihood
//! (3)  ln q = max over ξ of { ln Π L_r(ξ) - 1/4 |ξ|² } + k/2 ln 2             without earlier recordings, k parameters
//! ```
//!
//! Formula (1) is Laplace's approximation at the most probable ξ̂ of all recordings together (Tierney and Kadane 1986). In (2) the
//! earlier recordings are divided into two halves, and each takes both parts: L_h is the likelihood of half h, and p_h its mixture
//! density (1) under the distribution that the other half leaves. A contradiction to half of the earlier data thus counts in q.
//!
//! The ratio p_i / q_j tests explanation j at every value of its parameters by universal inference (Wasserman, Ramdas and
//! Balakrishnan 2020). For the true ξ* of j
//!
//! ```text
//! (4)  p_i / q_j  <=  { p_i / Π L_r(ξ*) }  mean over h of { p_h / L_h(ξ*) }
//! ```
//!
//! Given all earlier data the first factor has mean 1 over the new recordings, as p_i is a density of them that was fixed
//! before. Given the other half p_h / L_h has mean 1 over half h for the same reason. So the product is an e-value,
//! whatever the shape of the likelihood, and although the explanations were found on the earlier data: only p_i depends on what was
//! found. In (3) the parameters are k standard normal numbers by declaration, and exp(1/4 |ξ*|²) has mean 2^(k/2).

use crate::error::DesignError;
use crate::explanation::Explanation;
use crate::joint::Joint;
use crate::posterior::with_prior;
use crate::verdict::{Tally, log_sum};
use augsim_system::Record;

/// Weight of a prior as wide as the bounds in the search for the maximum (2).
///
/// It only keeps the steps finite: within the bounds it takes at most 0.015 nats for each parameter from the maximum.
const BOUNDS_WEIGHT: f64 = 0.01;

/// Evidence of recordings, and the parameters after them.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// With the distribution of the parameters before the recordings.
    mixture: Joint,
    /// The halves of the earlier recordings; empty without any.
    halves: Vec<Half>,
}

/// A half of the earlier recordings, joined by the new ones.
#[derive(Clone, Debug)]
struct Half {
    /// Logarithm of the mixture density of this half after the other one, nats.
    log_density: f64,
    /// This half and the new recordings, at the maximum of their likelihood.
    maximum: Joint,
}

impl Half {
    /// A half of the earlier recordings after the other half, from a prior as wide as the bounds.
    fn new(
        (broad, start): &(Explanation, Vec<f64>),
        half: &[Record],
        other: &[Record],
    ) -> Result<Self, DesignError> {
        let mut before = Joint::new(broad, 1.0, start.clone());
        before.add_all(other)?;
        let mut mixture = Joint::new(&before.updated(), 1.0, vec![0.0; start.len()]);
        mixture.add_all(half)?;
        let mut maximum = Joint::new(broad, BOUNDS_WEIGHT, start.clone());
        maximum.add_all(half)?;
        Ok(Self { log_density: mixture.log_density(), maximum })
    }
}

impl Evidence {
    /// No recording yet, and no earlier one: the parameters are distributed as the explanation says.
    pub fn new(prior: &Explanation) -> Self {
        Self { mixture: Joint::new(prior, 1.0, vec![0.0; prior.uncertain.len()]), halves: Vec::new() }
    }

    /// No recording yet; `earlier` recordings have left the distribution of the parameters.
    ///
    /// Every second recording is in the first half. A single one is no half: what it says does not count in q.
    ///
    /// # Errors
    /// A recording cannot be simulated, or its density is not finite.
    pub fn after(prior: &Explanation, earlier: &[Record]) -> Result<Self, DesignError> {
        let broad = with_prior(prior);
        let every_second = |first: usize| earlier.iter().skip(first).step_by(2).cloned().collect();
        let parts: [Vec<Record>; 2] = [every_second(0), every_second(1)];
        let halves = match earlier.len() {
            0 => return Ok(Self::new(prior)),
            1 => vec![Half::new(&broad, &[], earlier)?],
            _ => vec![Half::new(&broad, &parts[0], &parts[1])?, Half::new(&broad, &parts[1], &parts[0])?],
        };
        let evidence = Self { halves, ..Self::new(prior) };
        evidence.checked(earlier).map(|()| evidence)
    }

    /// Takes in a recording.
    ///
    /// # Errors
    /// The recording cannot be simulated, or the density is not finite.
    pub fn add(&mut self, record: &Record) -> Result<(), DesignError> {
        self.add_all(std::slice::from_ref(record))
    }

    /// Takes in recordings that are judged together.
    ///
    /// # Errors
    /// As [`Evidence::add`].
    pub fn add_all(&mut self, records: &[Record]) -> Result<(), DesignError> {
        self.mixture.add_all(records)?;
        for half in &mut self.halves {
            half.maximum.add_all(records)?;
        }
        self.checked(records)
    }

    /// An error that names the last of `records` if a density is not finite.
    fn checked(&self, records: &[Record]) -> Result<(), DesignError> {
        match self.log_density().is_finite() && self.log_maximum().is_finite() {
            true => Ok(()),
            false => Err(DesignError::NotFinite {
                name: self.mixture.prior.name.clone(),
                record: records.last().map(|r| r.id.clone()).unwrap_or_default(),
            }),
        }
    }

    /// The evidence without what only [`Evidence::log_maximum`] needs, for a truth of which the density alone is used.
    pub(crate) fn density_only(&self) -> Self {
        Self { mixture: self.mixture.clone(), halves: Vec::new() }
    }

    /// The explanation before the recordings.
    pub fn explanation(&self) -> &Explanation {
        &self.mixture.prior
    }

    /// Logarithm of the mixture density (1) of the recordings, nats.
    pub fn log_density(&self) -> f64 {
        self.mixture.log_density()
    }

    /// Logarithm of the maximised likelihood (2) of the recordings, nats.
    pub fn log_maximum(&self) -> f64 {
        if self.halves.is_empty() {
            return self.mixture.log_of_half_the_prior();
        }
        let inverses = self.halves.iter().map(|half| half.log_density - half.maximum.log_likelihood());
        (self.halves.len() as f64).ln() - log_sum(inverses)
    }

    /// The explanation with the parameters and the covariance after the recordings.
    pub fn updated(&self) -> Explanation {
        self.mixture.updated()
    }

    /// Evidence for a judgement.
    pub fn tally(&self) -> Tally {
        let (squares, count) = self.mixture.squares();
        Tally {
            log_weight: self.mixture.prior.log_weight,
            log_density: self.log_density(),
            log_maximum: self.log_maximum(),
            squares,
            count,
        }
    }
}
