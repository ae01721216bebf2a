//! Evidence of new recordings for an explanation: their mixture density and their maximised likelihood.
//!
//! The parameters have the coordinates ξ under the normal distribution N(0, I) that all earlier data leave. With
//! L_r(ξ) the density of the later samples of recording r given its first ones, its initial state integrated out, as in
//! `reduced.rs`,
//!
//! ```text
//! (1)  ln p = ln ∫ Π L_r(ξ) N(ξ; 0, I) dξ  =  ln Π L_r(ξ̂) - 1/2 |ξ̂|² - 1/2 ln |I + Σ A_r|      mixture
//! (2)  ln q = max over ξ of ln Π L_r(ξ)                                                          maximised likelihood
//! ```
//!
//! Formula (1) is Laplace's approximation at the most probable ξ̂ of all recordings together (Tierney and Kadane 1986). The
//! maximum (2) is over all values within the bounds, whatever earlier data say.
//!
//! The ratio p_i / q_j tests explanation j at every value of its parameters (universal inference: Wasserman, Ramdas and
//! Balakrishnan 2020): q_j is at least the likelihood at the true value, and p_i over that likelihood has mean 1, as p_i is a
//! density of the recordings.

use crate::error::DesignError;
use crate::explanation::Explanation;
use crate::joint::Joint;
use crate::posterior::with_prior;
use crate::verdict::Tally;
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
    /// Without it.
    maximum: Joint,
}

impl Evidence {
    /// No recording yet: the parameters are distributed as the explanation says.
    pub fn new(prior: &Explanation) -> Self {
        let (broad, start) = with_prior(prior);
        Self {
            mixture: Joint::new(prior, 1.0, vec![0.0; prior.uncertain.len()]),
            maximum: Joint::new(&broad, BOUNDS_WEIGHT, start),
        }
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
        self.maximum.add_all(records)?;
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
        // The larger of two local maxima.
        self.maximum.log_likelihood().max(self.mixture.log_likelihood())
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
