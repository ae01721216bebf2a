//! Errors before and after, on data that no decision has seen.
//!
//! Records that were kept out from the beginning are predicted by what the others show. Where there are too few to keep any out, fits and
//! choice among the sets that the search came to are repeated without each fifth of the data, which is then predicted (nested
//! cross-validation: Varma and Simon 2006).

use crate::addition::kinds;
use crate::columns::Family;
use crate::error_table::Lists;
use crate::fit::{Fit, fit_nuisance, merged};
use crate::free_runs::{FreeRuns, mean_error};
use crate::outliers::{self, left_out};
use crate::prepare::Prepared;
use crate::records::View;
use crate::score::Scored;
use crate::search::{Found, Search, chosen_again, refitted};
use rayon::prelude::*;

/// Parts that are left out in turn.
pub(crate) const FOLDS: usize = 5;

/// Errors on data that no decision has seen.
pub(crate) struct Errors {
    pub lists: Lists,
    /// Kinds that the search found without each fold; none where records were kept out.
    pub folds: Vec<Vec<String>>,
    /// Errors of free runs of whole recordings: calibrated, augmented.
    pub free_run: Option<[f64; 2]>,
}

/// Sums of squared errors and numbers of samples, by channel, of the calibrated and of the augmented model.
type Sums = [Vec<(f64, f64)>; 2];

/// One part of the data, predicted by fits that have not seen it.
struct Predicted {
    lists: Lists,
    /// Sums of squared errors of free runs, by channel.
    free_runs: Option<Sums>,
    found: Vec<String>,
}

/// Errors of the fits (calibrated, augmented) on the records that were kept out, or of the procedure on folds.
pub(crate) fn errors(
    prepared: &Prepared,
    joined: usize,
    families: &[Family],
    known: &Found,
    best: usize,
    seed: u64,
) -> Errors {
    let (base, best) = (known.base(), &known.tried[best]);
    if !prepared.kept_out.is_empty() {
        let predicted = predicted(prepared, &prepared.kept_out, [&base.fit, &best.fit], seed);
        return Errors { lists: predicted.lists, folds: Vec::new(), free_run: means(&[predicted.free_runs]) };
    }
    let folds = folds(prepared);
    let of = |fold: &Vec<usize>| {
        let rest: Vec<usize> = prepared.searched.iter().copied().filter(|j| !fold.contains(j)).collect();
        let view = View::new(prepared, &rest, joined);
        let sample = view.sample();
        let start = Scored::new(&sample, &view.blocks, refitted(&view, &base.fit));
        let search = Search::new(&view, families, &prepared.clock);
        let mut found = chosen_again(&search, start, known);
        let named = crate::judge::named(&search, &mut found);
        let (calibrated, augmented) = (&found.base().fit, &found.tried[named].fit);
        let on_fold = predicted(prepared, fold, [calibrated, augmented], seed);
        Predicted { found: kinds(&augmented.hypothesis.additions), ..on_fold }
    };
    let done: Vec<Predicted> = folds.par_iter().map(of).collect();
    let mut out = Errors { lists: Lists::default(), folds: Vec::new(), free_run: None };
    let mut runs = Vec::new();
    for predicted in done {
        out.lists.extend(predicted.lists);
        out.folds.push(predicted.found);
        runs.push(predicted.free_runs);
    }
    out.free_run = means(&runs);
    out
}

/// The records of each fold: every fifth of each group by order. What is alone in its group is in none: without it nothing is known of the
/// group.
fn folds(prepared: &Prepared) -> Vec<Vec<usize>> {
    let data = &prepared.data;
    let group = |j: usize| data.records[j].seen.group;
    let of_group = |g: usize| prepared.searched.iter().filter(move |j| group(**j) == g).count();
    let dealt: Vec<usize> = prepared.searched.iter().copied().filter(|j| of_group(group(*j)) > 1).collect();
    let count = FOLDS.min(dealt.len());
    (0..count).map(|f| dealt.iter().copied().skip(f).step_by(count).collect()).collect()
}

/// Predictions of records by fits that have not seen them.
fn predicted(prepared: &Prepared, records: &[usize], [base, best]: [&Fit; 2], seed: u64) -> Predicted {
    let sample = prepared.sample(records);
    let on = |f: &Fit| fit_nuisance(&sample, &f.hypothesis, &f.theta, &[]);
    let held = on(best);
    let limit = forecast_limit(prepared, &held);
    let out = if limit.is_finite() { left_out(limit, [&on(base), &held]) } else { Vec::new() };
    let lists = Lists::of(&sample, [base, best], &held, &out, seed);
    let free_runs = FreeRuns::new(&sample).map(|runs| [base, best].map(|fit| summed(runs.squares(fit))));
    Predicted { lists, free_runs, found: Vec::new() }
}

/// Misfit of a window beyond which it is not forecast; infinite where every record counts.
pub(crate) fn forecast_limit(prepared: &Prepared, best: &Fit) -> f64 {
    if prepared.data.is_idealised() { outliers::limit(best) } else { f64::INFINITY }
}

fn summed(stretches: Vec<Vec<(f64, f64)>>) -> Vec<(f64, f64)> {
    let add = |a: Vec<(f64, f64)>, b: Vec<(f64, f64)>| {
        a.iter().zip(&b).map(|(a, b)| (a.0 + b.0, a.1 + b.1)).collect()
    };
    stretches.into_iter().reduce(add).unwrap_or_default()
}

/// Errors of free runs over several parts; nothing where one has none.
fn means(parts: &[Option<Sums>]) -> Option<[f64; 2]> {
    let all: Option<Vec<&Sums>> = parts.iter().map(Option::as_ref).collect();
    let all = all.filter(|all| !all.is_empty())?;
    Some([0, 1].map(|model| mean_error(&summed(all.iter().map(|part| part[model].clone()).collect()))))
}

/// Nuisances of all records from those of some.
pub(crate) fn starts(prepared: &Prepared, set: &Fit) -> Vec<Vec<f64>> {
    let kept = prepared.sample(&prepared.kept_out);
    let held = fit_nuisance(&kept, &set.hypothesis, &set.theta, &[]);
    merged(&[(&prepared.sample(&prepared.searched), set), (&kept, &held)])
}
