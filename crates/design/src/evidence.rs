//! Evidence of new recordings for an explanation: their mixture density and their maximised likelihood.
//!
//! The parameters have the coordinates ξ under the normal distribution N(0, I) that all earlier data leave. With
//! L_r(ξ) the density of the later samples of recording r given its first ones, its initial state integrated out, as in
//! `reduced.rs`,
//!
//! ```text
//! (1)  ln p = ln ∫ Π L_r(ξ) N(ξ; 0, I) dξ  =  ln Π L_r(ξ̂) - 1/2 |ξ̂|² - 1/2 ln |I + Σ A_r|      mixture
//! (2)  ln q = max over ξ of { ln Π L_r(ξ) - a/2 |ξ|² } - k/2 ln(1 - a)                          maximised likelihood
//! ```
//!
//! for k parameters, with a = 1/2 where earlier data leave ξ about normal, and a = 0 within the bounds where they do not. Formula
//! (1) is Laplace's approximation at the most probable ξ̂ of all recordings together (Tierney and Kadane 1986).
//!
//! The ratio p_i / q_j tests explanation j at every value of its parameters by universal inference (Wasserman, Ramdas and
//! Balakrishnan 2020). For the true ξ* of j
//!
//! ```text
//! (3)  p_i / q_j <= (1 - a)^(k/2) exp(a/2 |ξ*|²) p_i / Π L_r(ξ*)
//! ```
//!
//! where p_i / Π L_r has mean 1 over the new recordings, as p_i is a density of them. The factor before it is 1 for a = 0. Else
//! it has mean 1 over the earlier data, given which ξ* is k standard normal numbers. So the product is an e-value. a = 1/2 costs
//! 0.35 nats for each parameter, and leaves half of what earlier data say against other values; with a = 0 the explanation may
//! contradict them at no cost.

use crate::error::DesignError;
use crate::explanation::Explanation;
use crate::joint::Joint;
use crate::posterior::with_prior;
use crate::verdict::Tally;
use augsim_system::Record;

/// Share a of what normal earlier data say about the parameters that formula (2) keeps.
const KEPT_SHARE: f64 = 0.5;
/// Weight of a prior as wide as the bounds in the search for the maximum (2).
///
/// It only keeps the steps finite: within the bounds it takes at most 0.015 nats for each parameter from the maximum.
const BOUNDS_WEIGHT: f64 = 0.01;

/// Evidence of recordings, and the parameters after them.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// With the distribution of the parameters before the recordings.
    mixture: Joint,
    /// Without it, where it is not about normal.
    maximum: Option<Joint>,
}

impl Evidence {
    /// No recording yet: the parameters are distributed as the explanation says.
    pub fn new(prior: &Explanation) -> Self {
        let maximum = (!prior.is_normal).then(|| {
            let (broad, start) = with_prior(prior);
            Joint::new(&broad, BOUNDS_WEIGHT, start)
        });
        Self { mixture: Joint::new(prior, 1.0, vec![0.0; prior.uncertain.len()]), maximum }
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
        if let Some(maximum) = &mut self.maximum {
            maximum.add_all(records)?;
        }
        match self.log_density().is_finite() && self.log_maximum().is_finite() {
            true => Ok(()),
            false => Err(DesignError::NotFinite {
                name: self.mixture.prior.name.clone(),
                record: records.last().map(|r| r.id.clone()).unwrap_or_default(),
            }),
        }
    }

    /// Logarithm of the mixture density (1) of the recordings, nats.
    pub fn log_density(&self) -> f64 {
        self.mixture.log_density()
    }

    /// Logarithm of the maximised likelihood (2) of the recordings, nats.
    pub fn log_maximum(&self) -> f64 {
        match &self.maximum {
            None => self.mixture.log_discounted(KEPT_SHARE),
            // The larger of two local maxima.
            Some(maximum) => maximum.log_likelihood().max(self.mixture.log_likelihood()),
        }
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
            log_e_value: self.mixture.prior.log_e_value,
            log_density: self.log_density(),
            log_maximum: self.log_maximum(),
            squares,
            count,
        }
    }
}
