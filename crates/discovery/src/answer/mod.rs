//! The result in numbers and words.

mod errors;

use crate::fit::ChosenRecords;
use crate::prepare::Prepared;
use crate::records::View;
use crate::result::Estimate;
use crate::score::Scored;
use crate::search::{Search, SearchResult};
use crate::stages::Judged;
use augsim_system::Declaration;
pub(crate) use errors::{Errors, errors_of_fits, forecast_limit, measure_errors, nuisances_of_all};

/// Everything that the result is computed from.
pub(crate) struct AnswerParts<'a> {
    pub model: &'a dyn Declaration,
    pub prepared: &'a Prepared,
    pub search: &'a Search<'a>,
    pub found: &'a SearchResult,
    pub judged: &'a Judged,
    /// The calibrated model, on the searched records.
    pub base: &'a Scored,
    /// The final set, on the searched records.
    pub best: &'a Scored,
    /// All records.
    pub all_records: &'a View,
    /// The calibrated model, on all records.
    pub calibrated: &'a Scored,
    /// The final set, on all records.
    pub full: &'a Scored,
    pub errors: &'a Errors,
    /// Mean squared residual of a window above which it is not predicted.
    pub limit: f64,
    /// Standard deviation of the random effect per record.
    pub random_effect_sd: Option<Estimate>,
    /// Records on which predictions are shown.
    pub example_records: &'a ChosenRecords<'a>,
    pub seed: u64,
}
