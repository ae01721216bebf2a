//! Options of a discovery run, its deadline, and reports to the caller: progress and interim results.

use crate::result::Discovery;
use augsim_data::checks::AcceptedChecks;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Instant;

/// Options of a discovery run.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Seed of the resamples and noise replicates; with 20,000 resamples its influence is small.
    pub seed: u64,
    /// Number of simulated records without a missing effect, from which the false-positive rate is measured.
    pub null_runs: usize,
    /// Data checks whose findings are ignored.
    pub accepted: AcceptedChecks,
    /// Whether effects of the library are tried. Without them only formulas are searched, if the system has a
    /// grammar of formulas.
    pub library: bool,
    /// Which effects of the library are tried.
    pub effects: AllowedEffects,
    /// Deadline of calibration and search; `None` for no deadline. Fits stop there, and the best set of
    /// effects so far is judged. Searches that end before it do not depend on it.
    pub until: Option<Instant>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 0,
            null_runs: 19,
            accepted: AcceptedChecks::default(),
            library: true,
            effects: AllowedEffects::default(),
            until: None,
        }
    }
}

/// Which effects of the library a search tries, by the names under which the library lists them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AllowedEffects {
    /// Names of the only effects that are tried; empty for all. If it names any, formulas and values by group
    /// are not tried.
    pub only: Vec<String>,
    /// Names of effects that are not tried, even if `only` contains them.
    pub exclude: Vec<String>,
}

impl AllowedEffects {
    /// Whether the library effect with this name is tried.
    pub fn allows(&self, kind: &str) -> bool {
        let is_kind = |name: &String| name == kind;
        (self.only.is_empty() || self.only.iter().any(is_kind)) && !self.exclude.iter().any(is_kind)
    }

    /// Whether only the effects in `only` are tried.
    pub fn is_closed(&self) -> bool {
        !self.only.is_empty()
    }
}

/// Stage that a discovery run has reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Estimation of the noise and detection of events.
    Noise,
    /// Calibration of the declared parameters.
    Calibration,
    /// Search over the effects of the library. The number is the finished share of the largest possible
    /// search, in thousandths.
    Search(u16),
    /// Tests of the residuals that the best model leaves.
    ResidualTests,
    /// Search over formulas of a grammar.
    Formulas,
    /// Measurement of the prediction errors before and after adding effects.
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

    /// Approximate finished share of the whole run, from 0 to 1. It is approximate because searches differ in
    /// length.
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

/// Receiver of progress reports and interim results of a discovery run. Closures of [`Progress`] are
/// observers without interim results.
pub trait Observer {
    /// Receives the stage that the run has reached.
    fn report(&mut self, progress: Progress);

    /// Whether [`interim`](Self::interim) is to be called; computing interim results takes some simulations.
    fn takes_interim(&self) -> bool {
        false
    }

    /// Receives the calibrated model file, before any result is complete.
    fn calibrated(&mut self, _model_toml: String) {}

    /// Receives the best result so far, complete enough to be written if the run is stopped.
    fn interim(&mut self, _best_so_far: Discovery) {}
}

impl<F: FnMut(Progress)> Observer for F {
    fn report(&mut self, progress: Progress) {
        self(progress);
    }
}

/// Observer whose reported share of the run never decreases. Repeated searches report only what lies beyond
/// the share already reached.
pub(crate) struct Monotone<'a> {
    inner: &'a mut dyn Observer,
    largest_share: f64,
}

impl<'a> Monotone<'a> {
    pub fn new(inner: &'a mut dyn Observer) -> Self {
        Self { inner, largest_share: 0.0 }
    }
}

impl Observer for Monotone<'_> {
    fn report(&mut self, progress: Progress) {
        if progress.fraction() >= self.largest_share {
            self.largest_share = progress.fraction();
            self.inner.report(progress);
        }
    }

    fn takes_interim(&self) -> bool {
        self.inner.takes_interim()
    }

    fn calibrated(&mut self, model_toml: String) {
        self.inner.calibrated(model_toml);
    }

    fn interim(&mut self, best_so_far: Discovery) {
        self.inner.interim(best_so_far);
    }
}

/// Deadline of calibration and search. Clones share the flag that says whether it cut them short.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clock {
    until: Option<Instant>,
    state: Arc<ClockState>,
}

#[derive(Debug, Default)]
struct ClockState {
    /// Whether the deadline passed before all calibrations and searches were finished.
    was_cut: AtomicBool,
    /// Whether calibration and search have ended, so that later fits run to their ends.
    has_ended: AtomicBool,
}

impl Clock {
    pub fn new(options: &Options) -> Self {
        Self { until: options.until, state: Arc::default() }
    }

    /// Whether the deadline passed before all calibrations and searches were finished.
    pub fn was_cut(&self) -> bool {
        self.state.was_cut.load(Relaxed)
    }

    /// Whether the deadline has passed during the present calibration or search.
    pub fn is_over(&self) -> bool {
        if self.state.has_ended.load(Relaxed) {
            return false;
        }
        if self.until.is_some_and(|until| Instant::now() >= until) {
            self.state.was_cut.store(true, Relaxed);
        }
        self.was_cut()
    }

    /// Marks calibration and search as ended: the deadline does not apply to later fits.
    pub fn end_search(&self) {
        self.state.has_ended.store(true, Relaxed);
    }
}

impl Discovery {
    /// Marks a result as stopped after `seconds`; `cause` is the reason, for example "at its time limit".
    pub fn mark_stopped(&mut self, cause: &str, seconds: f64) {
        self.sentence = format!("The search was stopped {cause}. {}", self.sentence);
        self.cut_after_s = Some(seconds);
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the reported progress never decreases, a deadline ends the search only, and an effect is tried
    //! only if the user allows it.
    use super::*;

    #[test]
    fn a_second_search_does_not_reset_the_progress() {
        let mut shares = Vec::new();
        let mut record = |step: Progress| shares.push(step.fraction());
        let mut step = Monotone::new(&mut record);
        use Progress::*;
        let second = [Search(0), Search(500), Search(1000)];
        [Noise, Calibration, Search(700)].into_iter().chain(second).for_each(|p| step.report(p));
        [Formulas].into_iter().chain(second).chain([ResidualTests, Errors]).for_each(|p| step.report(p));
        assert!(shares.is_sorted() && shares.len() == 6, "{shares:?}");
    }

    #[test]
    fn an_effect_is_tried_if_only_names_it_and_exclude_does_not() {
        let names = |list: &[&str]| list.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>();
        let all = AllowedEffects::default();
        assert!(all.allows("drag") && !all.is_closed());
        let without = AllowedEffects { exclude: names(&["drag"]), ..AllowedEffects::default() };
        assert!(!without.allows("drag") && without.allows("magnus") && !without.is_closed());
        let both = AllowedEffects { only: names(&["drag", "magnus"]), exclude: names(&["drag"]) };
        assert!(!both.allows("drag") && both.allows("magnus") && !both.allows("wind") && both.is_closed());
    }

    #[test]
    fn the_deadline_holds_for_the_search_only() {
        let past = Options { until: Some(Instant::now()), ..Options::default() };
        let clock = Clock::new(&past);
        let copy = clock.clone();
        assert!(copy.is_over() && clock.was_cut());
        clock.end_search();
        assert!(!copy.is_over() && copy.was_cut());
        let free = Clock::new(&Options::default());
        assert!(!free.is_over() && !free.was_cut());
    }
}
