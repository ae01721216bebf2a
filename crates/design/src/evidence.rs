//! Evidence of new recordings for an explanation: their mixture density and their maximised likelihood.
//!
//! The parameters have the coordinates ξ under the normal distribution N(0, I) that all earlier data leave. With
//! L_r(ξ) the density of the later samples of recording r given its first ones, its initial state integrated out, as in
//! `reduced.rs`,
//!
//! ```text
//! (1)  p    = 9/10 ∫ Π L_r(ξ) N(ξ; 0, I) dξ + 1/10 ∫ Π L_r(ξ) B(ξ) dξ                          mixture density
//! (2)  1/q  = mean over h of  p_h / max over ξ of { L_h(ξ) Π L_r(ξ) }                          maximised likelihood
//! (3)  ln q = max over ξ of { ln Π L_r(ξ) - 1/4 |ξ|² } + k/2 ln 2             without earlier recordings, k parameters
//! ```
//!
//! B is the normal distribution that is as wide as the bounds of the parameters, or as 100 standard errors of the fit: earlier data whose parameters lie on a curve, or at a
//! bound, may leave N(0, I) far from the truth, and the second part of (1) is then the larger one. The integrals are Laplace's
//! approximation ln Π L_r(ξ̂) - 1/2 |ξ̂|² - 1/2 ln |I + Σ A_r| at the most probable ξ̂ of all recordings together (Tierney and
//! Kadane 1986). Without earlier recordings N(0, I) is the declared distribution, and p is the first integral alone.
//!
//! In (2) the earlier recordings are divided into two halves, and each takes both parts: L_h is the likelihood of half h, and p_h its
//! density (1) with the distribution that the other half leaves. A contradiction to half of the earlier data thus counts in q.
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
use crate::posterior::{after_recordings_from, with_prior, with_prior_of_draws};
use crate::verdict::{Tally, log_sum};
use augsim_system::Record;
use std::sync::Arc;

/// Weight of a prior as wide as the bounds in the search for the maximum (2).
///
/// It only keeps the steps finite: within the bounds it takes at most 0.015 nats for each parameter from the maximum.
const BOUNDS_WEIGHT: f64 = 0.01;

/// Weight in formula (1) of the distribution that is as wide as the bounds.
///
/// Any weight is valid. This one costs 0.1 nats where the narrow distribution contains the truth, and 2.3 where it does not.
const WIDE_WEIGHT: f64 = 0.1;

/// Recordings with the two distributions of formula (1).
#[derive(Clone, Debug)]
struct Mixture {
    /// With the distribution of the parameters before the recordings.
    narrow: Joint,
    /// With the distribution that is as wide as the bounds; `None` without earlier recordings.
    wide: Option<Joint>,
}

impl Mixture {
    /// No recording yet; `broad` is the wide distribution, with the start of the search in it.
    fn new(prior: &Explanation, broad: Option<(Explanation, Vec<f64>)>) -> Self {
        let narrow = Joint::new(prior, 1.0, vec![0.0; prior.uncertain.len()]);
        Self { narrow, wide: broad.map(|(broad, start)| Joint::new(&broad, 1.0, start)) }
    }

    fn add_all(&mut self, records: &[Record]) -> Result<(), DesignError> {
        std::iter::once(&mut self.narrow).chain(&mut self.wide).try_for_each(|joint| joint.add_all(records))
    }

    /// Logarithms of the two parts of formula (1), nats.
    fn log_parts(&self) -> [f64; 2] {
        let narrow = self.narrow.log_density();
        match &self.wide {
            None => [narrow, f64::NEG_INFINITY],
            Some(wide) => [narrow + (1.0 - WIDE_WEIGHT).ln(), wide.log_density() + WIDE_WEIGHT.ln()],
        }
    }

    fn log_density(&self) -> f64 {
        log_sum(self.log_parts().into_iter())
    }

    /// The recordings with the distribution that has the larger part in formula (1).
    fn likelier(&self) -> &Joint {
        let [narrow, wide] = self.log_parts();
        self.wide.as_ref().filter(|_| wide > narrow).unwrap_or(&self.narrow)
    }
}

/// Evidence of recordings, and the parameters after them.
#[derive(Clone, Debug)]
pub struct Evidence {
    mixture: Mixture,
    /// The halves of the earlier recordings; empty without any.
    halves: Vec<Half>,
    /// All earlier recordings, from the prior of draws; `None` without any.
    earlier: Option<Arc<Joint>>,
    /// Whether further recordings are taken into the mixture density.
    has_density: bool,
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
    fn new(wide: &(Explanation, Vec<f64>), half: &[Record], other: &[Record]) -> Result<Self, DesignError> {
        let (broad, start) = wide;
        let mut mixture = Mixture::new(&after_recordings_from(wide, other)?, Some(wide.clone()));
        mixture.add_all(half)?;
        let mut maximum = Joint::new(broad, BOUNDS_WEIGHT, start.clone());
        maximum.add_all(half)?;
        Ok(Self { log_density: mixture.log_density(), maximum })
    }
}

/// Moves each half to the maximum that begins at the parameters of the other one, if its recordings are likelier there.
///
/// The likelihood may have several maxima, as where the width of a friction law reaches its bound; the halves rarely end at the same wrong
/// one.
fn start_from_each_other(halves: &mut [Half]) {
    if let [first, second] = halves {
        let [of_first, of_second] = [&*first, &*second].map(|half| half.maximum.xi().to_vec());
        first.maximum.start_from(&of_second);
        second.maximum.start_from(&of_first);
    }
}

impl Evidence {
    /// No recording yet, and no earlier one: the parameters are distributed as the explanation says.
    pub fn new(prior: &Explanation) -> Self {
        Self { mixture: Mixture::new(prior, None), halves: Vec::new(), earlier: None, has_density: true }
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
        let mut halves = match earlier.len() {
            0 => return Ok(Self::new(prior)),
            1 => vec![Half::new(&broad, &[], earlier)?],
            _ => vec![Half::new(&broad, &parts[0], &parts[1])?, Half::new(&broad, &parts[1], &parts[0])?],
        };
        start_from_each_other(&mut halves);
        let (prior_of_draws, start) = with_prior_of_draws(prior);
        let mut all = Joint::new(&prior_of_draws, 1.0, start);
        all.add_all(earlier)?;
        let mixture = Mixture::new(prior, Some(broad));
        let evidence = Self { mixture, halves, earlier: Some(Arc::new(all)), has_density: true };
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
        if self.has_density {
            self.mixture.add_all(records)?;
        }
        self.halves.iter_mut().try_for_each(|half| half.maximum.add_all(records))?;
        start_from_each_other(&mut self.halves);
        self.checked(records)
    }

    /// An error that names the last of `records` if a density is not finite.
    fn checked(&self, records: &[Record]) -> Result<(), DesignError> {
        match self.log_density().is_finite() && self.log_maximum().is_finite() {
            true => Ok(()),
            false => Err(DesignError::NotFinite {
                name: self.explanation().name.clone(),
                record: records.last().map(|r| r.id.clone()).unwrap_or_default(),
            }),
        }
    }

    /// The evidence without what only [`Evidence::log_maximum`] needs, for a truth of which the density alone is used.
    pub(crate) fn density_only(&self) -> Self {
        Self { halves: Vec::new(), ..self.clone() }
    }

    /// The evidence without what only [`Evidence::log_density`] needs, for a rival of which the maximum alone is used.
    ///
    /// Without earlier recordings the maximum needs all of it.
    pub(crate) fn maximum_only(&self) -> Self {
        Self { has_density: self.halves.is_empty(), ..self.clone() }
    }

    /// All recordings with the prior of draws, or the declared distribution of the parameters without earlier recordings.
    pub(crate) fn all_recordings(&self) -> Result<Joint, DesignError> {
        match (&self.earlier, &self.mixture.wide) {
            (Some(earlier), Some(new)) => earlier.joined(new),
            _ => Ok(self.mixture.narrow.clone()),
        }
    }

    /// The explanation before the recordings.
    pub fn explanation(&self) -> &Explanation {
        &self.mixture.narrow.prior
    }

    /// Logarithm of the mixture density (1) of the recordings, nats.
    pub fn log_density(&self) -> f64 {
        self.mixture.log_density()
    }

    /// Logarithm of the maximised likelihood (2) of the recordings, nats.
    pub fn log_maximum(&self) -> f64 {
        if self.halves.is_empty() {
            return self.mixture.narrow.log_of_half_the_prior();
        }
        let inverses = self.halves.iter().map(|half| half.log_density - half.maximum.log_likelihood());
        (self.halves.len() as f64).ln() - log_sum(inverses)
    }

    /// The explanation with the parameters and the covariance after the recordings.
    pub fn updated(&self) -> Explanation {
        self.mixture.likelier().updated()
    }

    /// Evidence for a judgement.
    pub fn tally(&self) -> Tally {
        let (squares, count) = self.mixture.likelier().squares();
        Tally {
            log_weight: self.explanation().log_weight,
            log_density: self.log_density(),
            log_maximum: self.log_maximum(),
            squares,
            count,
        }
    }
}
