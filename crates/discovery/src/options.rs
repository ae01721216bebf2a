//! Choices of a caller, and reports of progress to it.

use augsim_data::checks::Accepted;
use std::time::Instant;

/// Choices of a discovery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Seed of resamples and replicates. It decides nothing: 200 resamples make its effect small.
    pub seed: u64,
    /// Records without a missing effect that the search is tried on, to tell how often it names one.
    pub null_runs: usize,
    /// Checks of suspicious data that are not made.
    pub accepted: Accepted,
    /// Whether effects of the library are tried. Without them formulas are looked for at once, where the system has a grammar.
    pub library: bool,
    /// When the search is to end with the best so far; never without it. An answer that was not cut does not depend on it.
    pub until: Option<Instant>,
}

impl Options {
    /// Whether the time is over.
    pub(crate) fn is_over(&self) -> bool {
        self.until.is_some_and(|until| Instant::now() >= until)
    }
}

impl Default for Options {
    fn default() -> Self {
        Self { seed: 0, null_runs: 19, accepted: Accepted::default(), library: true, until: None }
    }
}

/// How far a discovery is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Noise and events.
    Noise,
    /// Calibration of the declared parameters.
    Calibration,
    /// Search over the library: so many thousandths of the largest one that there can be.
    Searched(u16),
    /// Tests of the best model.
    Adequacy,
    /// Formulas of a grammar.
    Formulas,
    /// Errors before and after.
    Errors,
}

impl Progress {
    /// The step in words.
    pub fn describe(self) -> &'static str {
        match self {
            Progress::Noise => "finding events and estimating the noise",
            Progress::Calibration => "calibrating the declared parameters",
            Progress::Searched(_) => "fitting candidate effects",
            Progress::Adequacy => "testing what the best model leaves",
            Progress::Formulas => "looking for a formula",
            Progress::Errors => "measuring errors on held-out trajectories",
        }
    }

    /// The share of the whole that is done, roughly: searches differ in how far they have to go.
    pub fn fraction(self) -> f64 {
        match self {
            Progress::Noise => 0.0,
            Progress::Calibration => 0.03,
            Progress::Searched(thousandths) => 0.08 + 0.42 * (f64::from(thousandths) / 1000.0).min(1.0),
            Progress::Adequacy => 0.50,
            Progress::Formulas => 0.66,
            Progress::Errors => 0.72,
        }
    }
}

/// Tells `progress` of steps that go on; those of a search that begins anew behind another are as far as the one that led to it.
pub(crate) fn onward(progress: &mut dyn FnMut(Progress)) -> impl FnMut(Progress) {
    let mut furthest = 0.0;
    move |step| {
        if step.fraction() >= furthest {
            furthest = step.fraction();
            progress(step);
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: what is told of the progress never goes back.
    use super::*;

    #[test]
    fn a_second_search_does_not_begin_at_nothing() {
        let mut told = Vec::new();
        let mut keep = |step: Progress| told.push(step.fraction());
        let mut step = onward(&mut keep);
        use Progress::*;
        let second = [Searched(0), Searched(500), Searched(1000)];
        [Noise, Calibration, Searched(700)].into_iter().chain(second).for_each(&mut step);
        [Formulas].into_iter().chain(second).chain([Adequacy, Errors]).for_each(&mut step);
        drop(step);
        assert!(told.is_sorted() && told.len() == 6, "{told:?}");
    }
}
