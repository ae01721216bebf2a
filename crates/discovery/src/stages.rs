//! Intermediate results of a discovery: after the search and after the judgement.

use crate::columns::Family;
use crate::judge::{Findings, ResidualTests, named_set};
use crate::prepare::{Prepared, residual_sds};
use crate::random_effect_test::RandomEffectEstimate;
use crate::records::View;
use crate::result::Verdict;
use crate::score::{BEYOND_NOISE, Scored};
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

    /// The set of effects that would be named before resampling.
    pub fn named_set(&mut self, prepared: &Prepared) -> Scored {
        let SearchStage { view, families, found } = self;
        let named = named_set(&Search::new(view, families, &prepared.clock), found);
        found.sets[named].clone()
    }

    /// Whether the residuals of a set exceed the noise in a channel.
    pub fn exceeds_noise(&self, prepared: &Prepared, set: &Scored) -> bool {
        let residual_sd = residual_sds(&self.view.sample(), &set.fit);
        residual_sd.iter().zip(&prepared.noise.sd).any(|(residual_sd, sd)| *residual_sd > BEYOND_NOISE * sd)
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

/// Repeats a search with the candidates of one more family.
///
/// Effects that only imitate a missing one leave residuals in which it does not show. So if effects were found, one search
/// begins without any, and another with all sets that are known then.
pub(crate) fn search_with(prepared: &Prepared, searched: &SearchStage, family: Family) -> SearchStage {
    let SearchStage { view, families, found } = searched;
    let families = [&families[..], &[family]].concat();
    let mut search = Search::new(view, &families, &prepared.clock);
    let mut known_sets: Vec<Scored> = found.sets[1..].to_vec();
    if !found.best().additions().is_empty() {
        search.fitted = &found.sets[1..];
        let afresh = run(&search, found.base().clone(), Vec::new(), &mut |_| {});
        let is_new = |set: &Scored| found.with_key(&set.key()).is_none();
        known_sets.extend(afresh.sets.into_iter().filter(is_new));
    }
    let found = run(&search, found.base().clone(), known_sets, &mut |_| {});
    SearchStage { view: view.clone(), families, found }
}
