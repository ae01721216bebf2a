//! Counts of the work that an answer takes.
//!
//! Unlike seconds they are the same on every machine and for any number of threads, so that a test can notice a loop that has
//! become slower, and say by how much.

use crate::result::Work;
use std::sync::atomic::{AtomicU64, Ordering};

/// Counters of one discovery. Threads add to them in any order: the sums are the same.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    simulations: AtomicU64,
    fits: AtomicU64,
    scores: AtomicU64,
}

impl Tally {
    /// Counts one simulation with derivatives.
    pub fn simulation(&self) {
        self.simulations.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts one minimisation.
    pub fn fit(&self) {
        self.fits.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts one candidate whose gain was predicted without a fit.
    pub fn score(&self) {
        self.scores.fetch_add(1, Ordering::Relaxed);
    }

    /// The counts so far.
    pub fn work(&self) -> Work {
        let [simulations, fits, scores] =
            [&self.simulations, &self.fits, &self.scores].map(|c| c.load(Ordering::Relaxed));
        Work { simulations, fits, scores }
    }
}
