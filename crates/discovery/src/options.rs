//! Options of a discovery run with its deadline, and progress reports to the caller.

use crate::result::Discovery;
use augsim_data::checks::AcceptedChecks;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Instant;

/// Options of a discovery run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Seed of the resamples and noise replicates; with 20,000 resamples its influence is small.
    pub seed: u64,
    /// Number of simulated records without a missing effect, on which the false-positive rate is measured.
    pub null_runs: usize,
    /// Data checks that are skipped.
    pub accepted: AcceptedChecks,
    /// Whether effects of the library are tried; without them only formulas are searched, if the system has
    /// a grammar.
    pub library: bool,
    /// Deadline after which the search stops with the best set so far; `None` for no deadline. Runs that end
    /// before it do not depend on it.
    pub until: Option<Instant>,
}

impl Options {
    /// Whether the deadline has passed.
    pub(crate) fn is_over(&self) -> bool {
        self.until.is_some_and(|until| Instant::now() >= until)
    }
}

impl Default for Options {
    fn default() -> Self {
        Self { seed: 0, null_runs: 19, accepted: AcceptedChecks::default(), library: true, until: None }
    }
}

/// Stage that a discovery run has reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Noise estimation and event detection.
    Noise,
    /// Calibration of the declared parameters.
    Calibration,
    /// Search over the library; the number is the finished share of the largest possible search, in
    /// thousandths.
    Search(u16),
    /// Tests of the residuals of the best model.
    ResidualTests,
    /// Search over formulas of a grammar.
    Formulas,
    /// Prediction errors before and after.
    Errors,
}

impl Progress {
    /// Description of the stage for a progress display.
    pub fn describe(self) -> &'static str {
        match self {
            Progress::Noise => "finding events and estimating the noise",
            Progress::Calibration => "calibrating the declared parameters",
            Progress::Search(_) => "fitting candidate effects",
            Progress::ResidualTests => "testing the residuals of the best model",
            Progress::Formulas => "searching for a formula",
            Progress::Errors => "measuring errors on held-out trajectories",
        }
    }

    /// Approximate finished share of the whole run, from 0 to 1; searches differ in length.
    pub fn fraction(self) -> f64 {
        match self {
            Progress::Noise => 0.0,
            Progress::Calibration => 0.03,
            Progress::Search(thousandths) => 0.08 + 0.42 * (f64::from(thousandths) / 1000.0).min(1.0),
            Progress::ResidualTests => 0.50,
            Progress::Formulas => 0.66,
            Progress::Errors => 0.72,
        }
    }
}

/// Wraps `progress` so that the reported share never decreases: repeated searches report only what lies
/// beyond the share already reached.
pub(crate) fn monotone(progress: &mut dyn FnMut(Progress)) -> impl FnMut(Progress) {
    let mut largest_share = 0.0;
    move |step| {
        if step.fraction() >= largest_share {
            largest_share = step.fraction();
            progress(step);
        }
    }
}

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

#[cfg(test)]
mod tests {
    //! Contract: the reported progress never decreases.
    use super::*;

    #[test]
    fn a_second_search_does_not_reset_the_progress() {
        let mut shares = Vec::new();
        let mut record = |step: Progress| shares.push(step.fraction());
        let mut step = monotone(&mut record);
        use Progress::*;
        let second = [Search(0), Search(500), Search(1000)];
        [Noise, Calibration, Search(700)].into_iter().chain(second).for_each(&mut step);
        [Formulas].into_iter().chain(second).chain([ResidualTests, Errors]).for_each(&mut step);
        drop(step);
        assert!(shares.is_sorted() && shares.len() == 6, "{shares:?}");
    }
}
