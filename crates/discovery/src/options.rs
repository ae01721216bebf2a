//! Choices of a caller, and reports of progress to it.

use augsim_data::checks::Accepted;

/// Choices of a discovery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Seed of the split, the bootstrap and the replicates.
    pub seed: u64,
    /// Share of the trajectories that fits may see.
    pub train_share: f64,
    /// Checks of suspicious data that are not made.
    pub accepted: Accepted,
    /// Whether effects of the library are tried. Without them formulas are looked for at once, where the system has a grammar.
    pub library: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { seed: 0, train_share: 0.7, accepted: Accepted::default(), library: true }
    }
}

/// How far a discovery is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Noise and events.
    Noise,
    /// Calibration of the declared parameters.
    Calibration,
    /// Search over the library.
    Search,
    /// Tests of the best model.
    Adequacy,
    /// Laws that are not in the library.
    Unlisted,
    /// Formulas of a grammar.
    Formulas,
    /// Errors before and after.
    Errors,
    /// The loop once more on folds.
    Folds,
}

impl Progress {
    /// The step in words.
    pub fn describe(self) -> &'static str {
        match self {
            Progress::Noise => "finding events and estimating the noise",
            Progress::Calibration => "calibrating the declared parameters",
            Progress::Search => "fitting candidate effects",
            Progress::Adequacy => "testing what the best model leaves",
            Progress::Unlisted => "looking for a law outside the library",
            Progress::Formulas => "looking for a formula",
            Progress::Folds => "repeating the loop without each fifth of the data",
            Progress::Errors => "measuring errors on held-out trajectories",
        }
    }
}
