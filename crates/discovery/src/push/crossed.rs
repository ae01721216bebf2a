//! The whole loop again on parts of the pushes, so that every push is forecast once by a model that has not seen it: nested
//! cross-validation, as for the ball. The errors are those of the loop before the last rule, which only drops what most folds
//! do not find.

use super::decide::{Decided, outliers, sample, searched, settled, without};
use super::error_table::Lists;
use super::fit::fit_starts;
use super::measured::{Measured, split};
use crate::Options;
use crate::deal;
use crate::folds::{FOLDS, again, open};
use crate::result::ErrorTable;
use augsim_physics::model::PushModel;
use rayon::prelude::*;

/// Fewest pushes.
const FEWEST: usize = 10;
/// Pushes below which one split says little about what another would find.
const FEW: usize = 20;

/// What came out of the folds.
pub(crate) struct Crossed {
    pub lists: Lists,
    /// Kinds that each fold found.
    pub found: Vec<Vec<String>>,
}

/// Whether one split leaves the answer open: an effect was added, and there are few pushes, or there is error to remove and the
/// interval of its reduction includes no change.
pub(crate) fn worth_crossing(decided: &Decided<'_>, error: &ErrorTable) -> bool {
    let named = !decided.search.tried[decided.best].kinds().is_empty();
    let few = decided.search.train.data.records.len() < FEW;
    named && (few || open(error))
}

impl Crossed {
    /// Those of an answer that half of the folds or more find again (after Meinshausen and Bühlmann 2010); all of them, where
    /// that leaves none.
    pub fn stable(&self, kinds: &[&'static str]) -> Vec<&'static str> {
        let stable: Vec<&'static str> =
            kinds.iter().copied().filter(|k| 2 * again(&self.found, k) >= self.found.len()).collect();
        if stable.is_empty() { kinds.to_vec() } else { stable }
    }
}

/// Repeats the loop without each fold in turn and forecasts the fold; `None` where there are too few pushes.
pub(crate) fn crossed(model: &PushModel, measured: &Measured, options: &Options) -> Option<Crossed> {
    let n = measured.records.len();
    if n < FEWEST {
        return None;
    }
    let folds = deal::folds(&measured.group_of(), FOLDS, options.seed);
    let done: Vec<(Lists, Vec<String>)> = folds
        .par_iter()
        .map(|fold| {
            let rest: Vec<usize> = (0..n).filter(|j| !fold.contains(j)).collect();
            let (train, test) = split(measured, &rest, options);
            let search = searched(model, measured, &train, &test, &mut || true);
            let best = search.best();
            let decided = settled(search, best);
            // What was decided is fitted to all that the fold leaves.
            let fits = decided.refitted(&decided.everything());
            let mut seen = sample(measured, fold);
            seen.bend = decided.search.train.bend;
            let held = [0, 1].map(|i| fit_starts(&seen, &fits[i].hypothesis, &fits[i].theta));
            let kept = without(&seen, &outliers(&seen, [&held[0], &held[1]]));
            let [base, best] = &fits;
            let lists = Lists::of(model, measured, fold, &kept.windows, [base, best], options.seed);
            (lists, best.hypothesis.kinds.iter().map(|k| k.to_string()).collect())
        })
        .collect();
    let mut out = Crossed { lists: Lists::default(), found: Vec::new() };
    for (lists, found) in done {
        out.lists.extend(lists);
        out.found.push(found);
    }
    Some(out)
}
