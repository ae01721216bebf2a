//! The time of a search, and answers whose search was ended by it.

use crate::Options;
use crate::result::Discovery;
use rayon::prelude::*;
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

    /// Does jobs in their order, a few at a time, until the time is over; `told` hears the share that is done.
    pub fn worked_off<J: Sync, T: Send + Sync>(
        &self,
        jobs: &[J],
        told: &mut dyn FnMut(f64),
        work: impl Fn(&J) -> T + Sync,
    ) -> Vec<T> {
        self.worked_off_in(2 * rayon::current_num_threads(), jobs, told, |_, job| work(job))
    }

    /// Does jobs in their order, so many at a time, until the time is over. Each sees what came of all those before the jobs that it
    /// is done beside.
    pub fn worked_off_in<J: Sync, T: Send + Sync>(
        &self,
        at_a_time: usize,
        jobs: &[J],
        told: &mut dyn FnMut(f64),
        work: impl Fn(&[T], &J) -> T + Sync,
    ) -> Vec<T> {
        let mut done: Vec<T> = Vec::with_capacity(jobs.len());
        for some in jobs.chunks(at_a_time) {
            if self.is_over() {
                break;
            }
            let next: Vec<T> = some.par_iter().map(|job| work(&done, job)).collect();
            done.extend(next);
            told(done.len() as f64 / jobs.len() as f64);
        }
        done
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
