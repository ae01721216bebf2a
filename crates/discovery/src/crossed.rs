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
use crate::fit::{Fit, fit, fit_nuisance, merged};
use crate::folds::{FOLDS, folds_that_found, open};
use crate::judged::Judged;
use crate::outliers::{self, left_out};
use crate::prepare::{Prepared, split};
use crate::record::Measured;
use crate::result::ErrorTable;
use crate::search::Search;
use rayon::prelude::*;

/// Fewest trajectories a fold.
const FEWEST: usize = 4;

/// The outcome of all folds.
pub(crate) struct Crossed {
    pub lists: Lists,
    /// Kinds that each fold found.
    pub found: Vec<Vec<String>>,
}

/// Records below which one split says little about the findings of another, where laws are idealisations.
const FEW: usize = 20;
/// Fewest records for folds where laws are idealisations.
const ENOUGH: usize = 10;

/// Whether one split leaves an answer open: an effect was added that can lower a forecast's error (a scatter alone cannot;
/// tables are not looked for in folds), and there is error to remove and the interval includes no change. Where the laws of
/// the system are idealisations an answer from few records is open whatever its interval.
pub(crate) fn worth_crossing(data: &Measured, best: &Judged, error: &ErrorTable) -> bool {
    let lawful = best.additions().iter().any(|a| matches!(a, Addition::Effect(..) | Addition::Split(_)));
    lawful && (open(error) || data.is_idealised() && data.records.len() < FEW)
}

impl Crossed {
    /// Keeps the additions that half of the folds or more find again (after Meinshausen and Bühlmann 2010); all of them,
    /// where that leaves none.
    pub fn stable(&self, additions: &[Addition]) -> Vec<Addition> {
        let found = |a: &&Addition| {
            2 * folds_that_found(&self.found, &kinds(std::slice::from_ref(*a))[0]) >= self.found.len()
        };
        let stable: Vec<Addition> = additions.iter().filter(found).cloned().collect();
        if stable.is_empty() { additions.to_vec() } else { stable }
    }
}

/// Repeats the loop without each fold in turn and forecasts the fold; `None` where there are too few trajectories, or the time is
/// over.
pub(crate) fn crossed(prepared: &Prepared, family: Family, options: &Options) -> Option<Crossed> {
    let data = &prepared.data;
    let fewest = if data.is_idealised() { ENOUGH } else { FOLDS * FEWEST };
    if data.records.len() < fewest {
        return None;
    }
    let folds = deal::folds(&data.group_of(), FOLDS, options.seed);
    let done: Vec<(Lists, Vec<String>)> = folds
        .par_iter()
        .map(|fold| {
            let rest: Vec<usize> = (0..data.records.len()).filter(|j| !fold.contains(j)).collect();
            let (train, test) = split(data, &rest, options);
            let clock = &prepared.clock;
            let mut search = Search::new(prepared.sample(&train), prepared.sample(&test), family, clock);
            let base = calibrate(&search.train);
            let decided = decide(&mut search, base, &[], false, &mut |_| {})?;
            // What was decided is fitted to all that the fold leaves.
            let all = prepared.sample(&rest);
            let [base, best] = [&decided.base, &decided.best].map(|j| {
                let held = search.heldout(j);
                let nuisance = merged(&[(&search.train, &j.fit), (&search.test, held)]);
                fit(&all, &j.fit.hypothesis, &j.fit.theta, &nuisance)
            });
            let limit = forecast_limit(data, &decided.best.fit);
            let fold = prepared.sample(fold);
            let on_fold = |f: &Fit| fit_nuisance(&fold, &f.hypothesis, &f.theta, &[]);
            let held = on_fold(&best);
            let out = if limit.is_finite() { left_out(limit, [&on_fold(&base), &held]) } else { Vec::new() };
            let lists = Lists::of(&fold, [&base, &best], &held, &out, options.seed);
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

/// Misfit of a window beyond which it is not forecast; infinite where every record counts.
pub(crate) fn forecast_limit(data: &Measured, best: &Fit) -> f64 {
    if data.is_idealised() { outliers::limit(best) } else { f64::INFINITY }
}
