//! What a discovery result is computed from, and the prediction errors in it.

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

/// Everything from which the result of a discovery is computed.
pub(crate) struct AnswerParts<'a> {
    pub model: &'a dyn Declaration,
    pub prepared: &'a Prepared,
    pub search: &'a Search<'a>,
    pub found: &'a SearchResult,
    pub judged: &'a Judged,
    /// Fit of the calibrated model to the searched records.
    pub base: &'a Scored,
    /// Fit of the final set of effects to the searched records.
    pub best: &'a Scored,
    /// All records, including the held-out ones.
    pub all_records: &'a View,
    /// Fit of the calibrated model to all records.
    pub calibrated: &'a Scored,
    /// Fit of the final set of effects to all records.
    pub full: &'a Scored,
    pub errors: &'a Errors,
    /// Mean squared residual, in units of the noise variance, above which a window is excluded from the
    /// prediction errors.
    pub limit: f64,
    /// Standard deviation of the random effect per record; `None` if there is none.
    pub random_effect_sd: Option<Estimate>,
    /// Records whose predictions the result shows.
    pub example_records: &'a ChosenRecords<'a>,
    pub seed: u64,
}
