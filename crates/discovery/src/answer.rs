//! The loop's answer before it is put into words and numbers.

use crate::adequacy::Adequacy;
use crate::explore::Explored;
use crate::fit::Fit;
use crate::judged::Judged;
use crate::noise::Noise;
use crate::result::{Anatomy, ErrorTable, Estimate, Horizon, Verdict, Windows};
use crate::scattered::Scattered;
use crate::search::Search;
use augsim_physics::system::Declaration;
use std::collections::BTreeMap;

/// Everything that the result is made of.
pub(crate) struct AnswerParts<'a> {
    pub model: &'a dyn Declaration,
    pub search: &'a Search<'a>,
    pub noise: &'a Noise,
    pub found: &'a Explored,
    pub base: &'a Judged,
    pub best: &'a Judged,
    /// `base` and `best` over the windows of the search, which likelihoods of sets are compared over.
    pub searched: [&'a Judged; 2],
    /// How many windows of the search each window joins that the best model's parameters come of.
    pub joined: Option<usize>,
    /// The best model fitted to all trajectories.
    pub full: &'a Fit,
    pub tests: &'a Adequacy,
    pub verdict: Verdict,
    /// Why the data are not those of the declared system.
    pub doubt: Option<String>,
    pub severe: bool,
    pub error: ErrorTable,
    /// Error tables of further measures.
    pub errors: BTreeMap<String, ErrorTable>,
    pub horizons: Vec<Horizon>,
    pub windows: Option<Windows>,
    /// Parameters that are drawn anew for each record.
    pub scattered: Option<&'a Scattered>,
    /// Their standard deviation, from all records.
    pub drawn_sd: Option<Estimate>,
    /// Kinds that each fold found, where the loop was repeated on folds.
    pub folds: Vec<Vec<String>>,
    pub anatomy: Anatomy,
}
