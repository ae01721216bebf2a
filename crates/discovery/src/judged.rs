//! A fitted hypothesis with what it is chosen by.

use crate::addition::Addition;
use crate::drawn::{Estimated, Shared};
use crate::fit::Fit;
use crate::longer::Length;
use crate::scored::Score;
use std::sync::{Arc, OnceLock};

/// Odds of 100:1 in total criterion, below which an alternative is as good.
const AMBIGUOUS_TOTAL: f64 = 9.2;

/// Whether an alternative that is so far `behind` in the criterion, or in twice the ln likelihood of the held-out part, is as
/// good; `unit` is the size of one unit of the gain.
pub(crate) fn is_as_good(behind: f64, unit: f64) -> bool {
    behind < AMBIGUOUS_TOTAL * unit
}

/// A fitted hypothesis with its criterion, once also judged on the held-out part.
#[derive(Clone, Debug)]
pub(crate) struct Judged {
    pub fit: Fit,
    /// -2 ln likelihood on the training part plus penalties.
    pub criterion: f64,
    /// Penalty in it.
    pub penalty: f64,
    /// Size of one unit of the gain: the dispersion in the directions of the additions, 1 where residuals are taken for white.
    pub unit: f64,
    /// Ln likelihood of the held-out part.
    pub heldout_ll: Option<f64>,
    /// Error of free runs on the held-out part, where windows are shorter than recordings.
    pub free_run: Option<f64>,
    /// Results that were worked out at this fit, so that they are worked out once; copies share them.
    pub memory: Arc<Memory>,
}

/// Parameters that are drawn anew for each record at a fit: what all records share, and the estimate where there is one.
pub(crate) type DrawnAt = (Shared, Option<Arc<Estimated>>);

/// Results that the search that made a fit has worked out at it.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    /// The held-out part at the parameters of the fit.
    pub heldout: OnceLock<Fit>,
    /// Scores of the library.
    pub scores: OnceLock<Vec<Score>>,
    /// Errors of free runs after fits over ever longer windows.
    pub lengths: OnceLock<Option<Vec<Length>>>,
    /// The fit of the training part over windows of the best length.
    pub longer: OnceLock<Fit>,
    /// The estimate of parameters that are drawn anew for each record, from the training part.
    pub drawn: OnceLock<Option<DrawnAt>>,
}

impl Judged {
    /// Criterion of both parts together.
    pub fn total(&self) -> f64 {
        self.criterion - 2.0 * self.heldout_ll.unwrap_or(f64::NEG_INFINITY)
    }

    /// Whether it could be fitted: where no window can be simulated, a direction has no information, or so much that its interval has no
    /// width (derivatives that grow without bound along a run), there is no criterion.
    pub fn is_finite(&self) -> bool {
        let has_width = |[low, high]: &[f64; 2]| low.is_finite() && high.is_finite() && low < high;
        let intervals = || self.fit.ci95().iter().all(has_width);
        self.criterion.is_finite() && self.fit.theta.iter().all(|v| v.is_finite()) && intervals()
    }

    pub fn additions(&self) -> &[Addition] {
        &self.fit.hypothesis.additions
    }
}

#[cfg(test)]
mod tests {
    //! Contract: what is refuted by odds of less than 100 to 1 is as good as the best.
    use super::*;

    #[test]
    fn an_alternative_is_refuted_by_odds_of_a_hundred_to_one() {
        let behind = |odds: f64| 2.0 * odds.ln();
        assert!(is_as_good(behind(50.0), 1.0) && !is_as_good(behind(200.0), 1.0));
        assert!(is_as_good(behind(200.0), 2.0) && !is_as_good(behind(50.0), 0.5));
    }
}
