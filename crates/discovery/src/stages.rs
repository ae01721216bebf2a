//! Intermediate results of a discovery: after the search and after the judgement.

use crate::columns::Family;
use crate::judge::{Findings, ResidualTests};
use crate::prepare::Prepared;
use crate::random_effect_test::RandomEffectEstimate;
use crate::records::View;
use crate::result::Verdict;
use crate::score::Scored;
use crate::search::{Search, SearchResult, run};

/// A search result with the data that it was searched on and the families of candidates.
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

/// A search result with the judgement of its findings.
pub(crate) struct Judged {
    pub findings: Findings,
    /// Index in the fitted sets of the final set: the named effects, with tables where there are any.
    pub best: usize,
    pub random_effect: Option<RandomEffectEstimate>,
    pub residual_tests: ResidualTests,
    pub verdict: Verdict,
    /// Reason why the data are not from the declared system; `None` if they can be.
    pub withdrawal_reason: Option<String>,
}

/// Searches for effects on the data in `view`, from the calibrated model `base` and the already fitted
/// `known_sets`.
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
