//! The loop's answer before it is put into words and numbers.

use crate::adequacy::Adequacy;
use crate::fit::Fit;
use crate::noise::Noise;
use crate::result::{Anatomy, ErrorTable, Verdict};
use crate::search::{Found, Judged, Search};
use augsim_physics::system::Declaration;

/// Everything that the result is made of.
pub(crate) struct Parts<'a> {
    pub model: &'a dyn Declaration,
    pub search: &'a Search<'a>,
    pub noise: &'a Noise,
    pub found: &'a Found,
    pub base: &'a Judged,
    pub best: &'a Judged,
    /// The best model fitted to all trajectories.
    pub full: &'a Fit,
    pub tests: &'a Adequacy,
    pub verdict: Verdict,
    /// Why the data are not those of the declared system.
    pub doubt: Option<String>,
    pub severe: bool,
    pub error: ErrorTable,
    /// Kinds that each fold found, where the loop was repeated on folds.
    pub folds: Vec<Vec<String>>,
    pub anatomy: Anatomy,
}
