//! Counters of the work of a discovery run.
//!
//! Unlike run times they are the same on every machine and for any number of threads, so that a test can
//! detect a slower loop.

use crate::result::Work;
use std::sync::atomic::{AtomicU64, Ordering};

/// Counters of the work of one run. Threads add to them in any order; the sums do not depend on it.
#[derive(Debug, Default)]
pub(crate) struct WorkCounter {
    simulations: AtomicU64,
    fits: AtomicU64,
    scores: AtomicU64,
}

impl WorkCounter {
    /// Counts one simulation of a window with derivatives.
    pub fn count_simulation(&self) {
        self.simulations.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts one minimisation of the cost.
    pub fn count_fit(&self) {
        self.fits.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts one candidate effect whose gain was computed without a fit.
    pub fn count_score(&self) {
        self.scores.fetch_add(1, Ordering::Relaxed);
    }

    /// Returns the counts so far.
    pub fn totals(&self) -> Work {
        let [simulations, fits, scores] =
            [&self.simulations, &self.fits, &self.scores].map(|c| c.load(Ordering::Relaxed));
        Work { simulations, fits, scores }
    }
}
