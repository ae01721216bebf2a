//! Deadline of a search, and results that it cut short.

use crate::Options;
use crate::result::Discovery;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Instant;

/// The deadline of a search. Clones share whether it has cut the search short.
#[derive(Clone)]
pub(crate) struct Clock {
    options: Options,
    /// Whether the deadline passed before everything was tried.
    cut: Arc<AtomicBool>,
}

impl Clock {
    pub fn new(options: &Options) -> Self {
        Self { options: *options, cut: Arc::default() }
    }

    /// Whether the deadline passed before everything was tried.
    pub fn was_cut(&self) -> bool {
        self.cut.load(Relaxed)
    }

    /// Whether the deadline has passed; from then on nothing more is tried.
    pub fn is_over(&self) -> bool {
        if self.options.is_over() {
            self.cut.store(true, Relaxed);
        }
        self.was_cut()
    }
}

/// Marks a result whose search was ended by the deadline.
pub(crate) fn mark_cut_short(mut found: Discovery, start_time: Instant) -> Discovery {
    let seconds = start_time.elapsed().as_secs_f64();
    found.sentence = format!(
        "The search was stopped at its time limit; this is the best result so far. {}",
        found.sentence
    );
    found.cut_after_s = Some(seconds);
    found
}
