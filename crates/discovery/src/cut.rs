//! The time of a search, and answers whose search was ended by it.

use crate::Options;
use crate::result::Discovery;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Instant;

/// The time that a search has. A clone shares what the original knows of the end.
#[derive(Clone)]
pub(crate) struct Clock {
    options: Options,
    /// Whether the time was over before everything was tried.
    cut: Arc<AtomicBool>,
}

impl Clock {
    pub fn new(options: &Options) -> Self {
        Self { options: *options, cut: Arc::default() }
    }

    /// Whether the time was over before everything was tried.
    pub fn was_cut(&self) -> bool {
        self.cut.load(Relaxed)
    }

    /// Whether the time is over; from then on nothing more is tried.
    pub fn is_over(&self) -> bool {
        if self.options.is_over() {
            self.cut.store(true, Relaxed);
        }
        self.was_cut()
    }
}

/// Marks an answer as the best of what was tried until the time was over.
pub(crate) fn cut_short(mut found: Discovery, begun: Instant) -> Discovery {
    let seconds = begun.elapsed().as_secs_f64();
    found.sentence =
        format!("The time was over before the search was: the best of what was tried. {}", found.sentence);
    found.cut_after_s = Some(seconds);
    found
}
