//! The whole loop again on parts of the data, so that every trajectory is forecast once by a model that has not seen it.
//!
//! One split leaves few trajectories to judge by. In nested cross-validation (Stone 1974; Varma and Simon 2006) every step,
//! the search too, is repeated without the fold that it is judged on: the error is that of the procedure.

use crate::Options;
use crate::addition::{Addition, kinds};
use crate::calibrate::calibrate;
use crate::candidates::Family;
use crate::deal;
use crate::decide::decide;
use crate::error_table::Lists;
use crate::fit::{fit, merged};
use crate::folds::{FOLDS, open};
use crate::prepare::{Prepared, split};
use crate::result::ErrorTable;
use crate::search::{Judged, Search};
use rayon::prelude::*;

/// Fewest trajectories a fold.
const FEWEST: usize = 4;

/// The outcome of all folds.
pub(crate) struct Crossed {
    pub lists: Lists,
    /// Kinds that each fold found.
    pub found: Vec<Vec<String>>,
}

/// Whether one split leaves the gain of an answer open: an effect was added that can lower a forecast's error (a scatter alone
/// cannot; tables are not looked for in folds), there is error to remove, and the interval includes no change.
pub(crate) fn worth_crossing(best: &Judged, error: &ErrorTable) -> bool {
    let lawful = best.additions().iter().any(|a| matches!(a, Addition::Effect(..)));
    lawful && open(error)
}

/// Repeats the loop without each fold in turn and forecasts the fold; `None` where there are too few trajectories, or the time is
/// over.
pub(crate) fn crossed(prepared: &Prepared, family: Family, options: &Options) -> Option<Crossed> {
    let data = &prepared.data;
    if data.records.len() < FOLDS * FEWEST {
        return None;
    }
    let folds = deal::folds(&data.group_of(), FOLDS, options.seed);
    let done: Vec<(Lists, Vec<String>)> = folds
        .par_iter()
        .map(|fold| {
            let rest: Vec<usize> = (0..data.records.len()).filter(|j| !fold.contains(j)).collect();
            let (train, test) = split(data, &rest, options);
            let mut search = Search::new(prepared.sample(&train), prepared.sample(&test), family, options);
            let base = calibrate(&search.train);
            let decided = decide(&mut search, base, &[], false, &mut |_| {})?;
            // What was decided is fitted to all that the fold leaves.
            let all = prepared.sample(&rest);
            let [base, best] = [&decided.base, &decided.best].map(|j| {
                let held = search.heldout(&j.fit);
                let nuisance = merged(&[(&search.train, &j.fit), (&search.test, &held)]);
                fit(&all, &j.fit.hypothesis, &j.fit.theta, &nuisance)
            });
            let lists = Lists::of(&prepared.sample(fold), [&base, &best], options.seed);
            Some((lists, kinds(decided.best.additions())))
        })
        .collect::<Option<_>>()?;
    let mut out = Crossed { lists: Lists::default(), found: Vec::new() };
    for (lists, found) in done {
        out.lists.extend(lists);
        out.found.push(found);
    }
    (!options.is_over()).then_some(out)
}
