//! Everything that an answer is made of.

use super::Errors;
use crate::fit::ChosenRecords;
use crate::prepare::Prepared;
use crate::records::View;
use crate::result::Estimate;
use crate::score::Scored;
use crate::search::{Found, Search};
use crate::stages::Judged;
use augsim_physics::system::Declaration;

/// Everything that the result is made of.
pub(crate) struct AnswerParts<'a> {
    pub model: &'a dyn Declaration,
    pub prepared: &'a Prepared,
    pub search: &'a Search<'a>,
    pub found: &'a Found,
    pub judged: &'a Judged,
    /// The calibrated model and the answer, on the records that were searched.
    pub base: &'a Scored,
    pub best: &'a Scored,
    /// All records, and both sets on them.
    pub all: &'a View,
    pub calibrated: &'a Scored,
    pub full: &'a Scored,
    pub errors: &'a Errors,
    /// Misfit of a window beyond which it is not forecast.
    pub limit: f64,
    /// Standard deviation of parameters that are drawn anew for each record.
    pub drawn_sd: Option<Estimate>,
    /// Records that predictions are shown on.
    pub shown_on: &'a ChosenRecords<'a>,
    pub seed: u64,
}
