//! Deadlines of the option `--time-limit`.

use augsim_session::Usage;
use augsim_session::usage::Takes;
use std::time::{Duration, Instant};

/// Fraction of the time limit after which fits and search end.
///
/// Judging the findings and measuring their errors takes about as long as the search: the stages of
/// [`Progress::fraction`](augsim_discovery::Progress::fraction) before and after 0.5.
const SEARCH_SHARE: f64 = 0.5;

/// Deadlines of a command with a time limit: one for the search, one for the end.
#[derive(Debug, Clone, Copy)]
pub struct TimeLimit {
    /// Time at which fits and search end, so that time remains to assess their result.
    pub search: Instant,
    /// Time at which the command ends and writes the best result so far.
    pub end: Instant,
}

impl TimeLimit {
    /// Deadlines of a command that begins now and may take `seconds`; `None` without a time limit.
    ///
    /// # Errors
    /// The limit is not a positive time.
    pub fn from_now(seconds: Option<f64>) -> Result<Option<Self>, Usage> {
        let Some(seconds) = seconds else { return Ok(None) };
        let now = Instant::now();
        let limit = Duration::try_from_secs_f64(seconds).ok().filter(|limit| !limit.is_zero());
        let deadlines = limit.and_then(|limit| {
            Some(Self { search: now.checked_add(limit.mul_f64(SEARCH_SHARE))?, end: now.checked_add(limit)? })
        });
        let wrong = || Usage::option("--time-limit", seconds, Takes::PositiveSeconds);
        Ok(Some(deadlines.ok_or_else(wrong)?))
    }
}
