//! Intermediate results of the stages.

use crate::columns::Family;
use crate::judge::{Findings, ResidualTests};
use crate::prepare::Prepared;
use crate::random_effect_test::RandomEffectEstimate;
use crate::records::View;
use crate::result::Verdict;
use crate::score::Scored;
use crate::search::{Search, SearchResult, run};

/// A search result with its view of the data and its candidate families.
pub(crate) struct SearchStage {
    pub view: View,
    pub families: Vec<Family>,
    pub found: SearchResult,
}

impl SearchStage {
    pub fn search(&self, prepared: &Prepared) -> Search<'_> {
        Search::new(&self.view, &self.families, &prepared.clock)
    }
}

/// Judged search result.
pub(crate) struct Judged {
    pub findings: Findings,
    /// Index of the final set: the named set, with tables where there are some.
    pub best: usize,
    pub random_effect: Option<RandomEffectEstimate>,
    pub residual_tests: ResidualTests,
    pub verdict: Verdict,
    /// Reason why the data are not from the declared system.
    pub withdrawal_reason: Option<String>,
}

/// Searches data in the windows of `view`, from the calibrated model and sets that are already fitted.
pub(crate) fn search_in(
    prepared: &Prepared,
    view: View,
    families: &[Family],
    base: Scored,
    known_sets: Vec<Scored>,
    report_share: &mut dyn FnMut(f64),
) -> SearchStage {
    let found = run(&Search::new(&view, families, &prepared.clock), base, known_sets, report_share);
    SearchStage { view, families: families.to_vec(), found }
}
