//! Sets of which intervals or free runs support every addition.
//!
//! A likelihood over windows of a recording counts every sample as a witness. Where a law is still missing, or the motion has noise
//! of its own, the samples of a window miss alike: thousands of them pay for a term that a dozen windows say nothing of. An
//! interval counts windows (White 1982), and a term that its own interval does not tell from nothing is not named. With no more
//! windows than parameters that interval is none: there a term stays that the free run over held-out stretches is worse without.

use crate::addition::Addition;
use crate::explore::{Explored, place_of};
use crate::fit::Fit;
use crate::free_runs::NO_WORSE;
use crate::grammar::has_grammar;
use crate::judged::Judged;
use crate::search::Search;

/// The set without additions whose intervals hold their nulls: one after the other, the least supported first, the rest fitted
/// again. Where no recording is fitted in several windows, records are witnesses of their own, and the set stays.
pub(crate) fn supported(search: &Search<'_>, found: &mut Explored, base: &Judged, best: Judged) -> Judged {
    let mut best = best;
    while best.free_run.is_some() {
        let is_told = tells_intervals(best.fit.clusters.len(), best.fit.theta.len());
        let may_go = |less: &Judged| is_told || runs_as_well(less.free_run, best.free_run);
        match without_one(search, found, &best, best.fit.unclear(), Some(base), may_go) {
            Some(less) => best = less,
            None => break,
        }
    }
    best
}

/// The additions without one that all of the data do not tell from nothing, though the training part did: `all` is the fit of `best`
/// to all of them. Of recordings in several windows it stays where free runs are clearly worse without it, and where it is the only
/// one. Records that are witnesses of their own tell it at the level of the search, which tried many: a likelihood takes every sample
/// of them for one. (Systems without a grammar are not asked: measured drops lose a law by it beside their table.)
pub(crate) fn supported_by_all(
    search: &Search<'_>,
    found: &mut Explored,
    [base, best]: [&Judged; 2],
    all: &Fit,
) -> Option<Vec<Addition>> {
    if search.free_runs.is_none() && has_grammar(search.system()) {
        let unsure = all.unsure(search.level());
        return without_one(search, found, best, unsure, Some(base), |_| true)
            .map(|less| less.additions().to_vec());
    }
    let is_told = search.free_runs.is_some() && tells_intervals(all.clusters.len(), all.theta.len());
    let unclear = if is_told { all.unclear() } else { Vec::new() };
    let may_go = |less: &Judged| !search.part_runs_clearly_worse(less, best);
    without_one(search, found, best, unclear, None, may_go).map(|less| less.additions().to_vec())
}

/// The set without the first of its additions numbered `unclear` that may go; `nothing` is the set without any, where the last may go, too.
fn without_one(
    search: &Search<'_>,
    found: &mut Explored,
    best: &Judged,
    unclear: Vec<usize>,
    nothing: Option<&Judged>,
    may_go: impl Fn(&Judged) -> bool,
) -> Option<Judged> {
    unclear.into_iter().find_map(|number| {
        let rest = without(best.additions(), number);
        let less = if rest.is_empty() { nothing?.clone() } else { place_of(search, found, best, &rest) };
        (less.is_finite() && may_go(&less)).then_some(less)
    })
}

/// Whether so many windows or records tell the intervals of so many parameters: the scatter of n gradients has n - 1 directions.
fn tells_intervals(clusters: usize, parameters: usize) -> bool {
    clusters > parameters
}

/// Whether one free run is no worse than another.
fn runs_as_well(less: Option<f64>, best: Option<f64>) -> bool {
    less.zip(best).is_some_and(|(less, best)| less <= NO_WORSE * best)
}

/// Additions without one of them, and without those that act through it.
pub(crate) fn without(additions: &[Addition], number: usize) -> Vec<Addition> {
    let gone = &additions[number];
    let stays = |(other, addition): &(usize, &Addition)| *other != number && !addition.acts_through(gone);
    additions.iter().enumerate().filter(stays).map(|(_, addition)| addition.clone()).collect()
}

#[cfg(test)]
mod tests {
    //! Contract: intervals need more windows than parameters; where they are none, what runs worse without a term keeps it, and
    //! what runs as well goes without. A run that does not stay finite is never as good as one that does.
    use super::*;

    #[test]
    fn as_many_windows_as_parameters_tell_no_interval() {
        assert!(tells_intervals(12, 11) && !tells_intervals(11, 11) && !tells_intervals(6, 10));
    }

    #[test]
    fn a_term_stays_where_the_run_is_worse_without_it() {
        assert!(runs_as_well(Some(1.0), Some(1.0)) && runs_as_well(Some(0.9), Some(1.0)));
        assert!(!runs_as_well(Some(1.1), Some(1.0)));
        assert!(!runs_as_well(Some(f64::INFINITY), Some(1.0)));
        assert!(!runs_as_well(None, None) && !runs_as_well(Some(1.0), None));
    }
}
