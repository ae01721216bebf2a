//! A second search, over windows as long as data foretell each other best with.
//!
//! Short windows forgive a slow law: each begins where the data are. Where longer windows make better forecasts, laws are looked
//! for once more in them, from the sets that the first search came to, and what is found there counts if it runs better.

use crate::Progress;
use crate::addition::labels;
use crate::candidates::Family;
use crate::decide::{Decided, decide, settle};
use crate::fit::{ChosenRecords, fit_nuisance};
use crate::forecast::first_rmse;
use crate::free_runs::NO_WORSE;
use crate::judged::Judged;
use crate::longer::{fit_anew, joined_windows};
use crate::part::is_long;
use crate::prepare::Prepared;
use crate::search::Search;

/// The answer `decided`, or that of the search over longer windows where what it finds runs better. Data of very many samples
/// are not searched again: a pass over few long windows takes as long as one over many short ones.
pub(crate) fn over_long_windows(
    prepared: &Prepared,
    decided: Decided,
    family: Family,
    progress: &mut dyn FnMut(Progress),
) -> Decided {
    if is_long(&prepared.sample(&prepared.train)) {
        return decided;
    }
    let short = Search::on(prepared, family);
    let Some((before, joined)) = short.over_longer_windows(&decided.best) else { return decided };
    let [of_train, of_test] = [&short.train, &short.test].map(|sample| joined_windows(sample, joined));
    let train = ChosenRecords { data: &of_train.0, chosen: &of_train.1, ..short.train };
    let test = ChosenRecords { data: &of_test.0, chosen: &of_test.1, ..short.test };
    let free_runs = short.free_runs.clone();
    let mut long = Search { free_runs, ..Search::new(train, test, family, &prepared.clock) };
    let over_long = |judged: &Judged| fit_anew(&long.train, &judged.fit);
    let base = over_long(&decided.base);
    let sets = decided.found.pool.iter().filter(|j| !j.additions().is_empty());
    let known: Vec<Judged> = sets.map(|j| long.judge(over_long(j))).filter(Judged::is_finite).collect();
    let longer = match decide(&mut long, base, &known, false, progress) {
        Some(found) if labels(found.best.additions()) != labels(decided.best.additions()) => found.best,
        _ => return decided,
    };
    let mut best = back(&short, &longer, joined);
    best.heldout_ll = Some(short.heldout(&best).ll);
    if !forecasts_clearly_better(&short, &best, [&decided.best, &before]) {
        return decided;
    }
    let Decided { mut found, base, .. } = decided;
    found.pool.push(best.clone());
    settle(&short, found, base, best, false, progress)
}

/// A set of the search over windows that join so many of `short`'s, fitted over the windows of `short`, with the values that it came
/// with as those of the longer ones: from short windows, which forgive more, the way there may not be found again.
pub(crate) fn back(short: &Search<'_>, longer: &Judged, joined: usize) -> Judged {
    let starts = fit_nuisance(&short.train, &longer.fit.hypothesis, &longer.fit.theta, &[]);
    let best = short.refit(&starts, longer.additions(), &[]);
    short.know_longer(&best, joined, &starts);
    best
}

/// Whether a set runs clearly better than another, of which the second form is that over windows of its best length, through the
/// parts of the data that are left out in turn, and forecasts the parts of recordings that are held out no worse.
fn forecasts_clearly_better(search: &Search<'_>, set: &Judged, [other, other_longer]: [&Judged; 2]) -> bool {
    search.runs_clearly_better(set, other) && {
        let longer = search.over_longer_windows(set);
        let set = longer.as_ref().map_or(set, |(longer, _)| longer);
        let [set, other] = [set, other_longer].map(|judged| first_rmse(&search.test, &judged.fit));
        set <= NO_WORSE * other
    }
}
