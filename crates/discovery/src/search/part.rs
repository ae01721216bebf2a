//! A search on much data begins on a part of them, which excludes most sets of effects before any is fitted to all data.
//!
//! Evidence grows in proportion to the data: a set that is far behind on a part is farther behind on all of them. The search
//! on all data goes on from the sets that the part leaves, and finds the effects that only all data show.

use super::refit::Search;
use super::search_loop::{MAX_DEFICIT, MAX_REPEATED_SETS, SearchResult, run};
use crate::fit::{fit, fit_nuisance};
use crate::score::Scored;
use rayon::prelude::*;

/// Approximate number of samples of the part on which a search begins. An effect that removes 1 % of the residual variance
/// gains 40 nats on so many, far more than the penalty of any set.
const PART_SAMPLES: usize = 8192;

/// As [`run`], with a search on a part of the data first where there are many.
pub(crate) fn run_from_part(
    search: &Search<'_>,
    base: Scored,
    known: Vec<Scored>,
    report_share: &mut dyn FnMut(f64),
) -> SearchResult {
    let Some((part, of_part)) = search.view.part(PART_SAMPLES) else {
        return run(search, base, known, report_share);
    };
    let part_search = search.on(&part, known.iter().map(Scored::key).collect());
    let on_part = |set: &Scored| {
        let nuisance: Vec<Vec<f64>> = of_part.iter().map(|w| set.fit.nuisance[*w].clone()).collect();
        let fitted = fit(&part.sample(), &set.fit.hypothesis, &set.fit.theta, &nuisance);
        Scored::new(&part.sample(), &part.blocks, fitted)
    };
    let all = SearchResult { sets: [vec![base], known].concat(), best: 0, penalty: search.penalty() };
    let best_known = all.best_without(&|_| false);
    let known_on_part =
        if best_known.additions().is_empty() { Vec::new() } else { vec![on_part(best_known)] };
    let found = run(&part_search, on_part(all.base()), known_on_part, &mut |share| report_share(0.5 * share));
    let (near, far): (Vec<&Scored>, Vec<&Scored>) =
        found.sets.iter().partition(|set| found.margin(set, found.best()) > -MAX_DEFICIT);
    let excluded = far.iter().map(|set| set.key()).collect();
    let is_new = |set: &&&Scored| all.with_key(&set.key()).is_none();
    let on_all = |set: &&Scored| {
        let starts =
            fit_nuisance(&search.sample(), &set.fit.hypothesis, &set.fit.theta, &all.base().fit.nuisance);
        search.refit(&starts, set.additions(), &Vec::new())
    };
    let mut nearest: Vec<&Scored> = near.iter().filter(is_new).copied().collect();
    nearest.sort_by(|a, b| found.margin(b, found.best()).total_cmp(&found.margin(a, found.best())));
    nearest.truncate(MAX_REPEATED_SETS);
    let refitted: Vec<Scored> = nearest.par_iter().map(on_all).collect();
    let mut sets = all.sets;
    let base = sets.remove(0);
    sets.extend(refitted);
    run(&search.on(search.view, excluded), base, sets, &mut |share| report_share(0.5 + 0.5 * share))
}
