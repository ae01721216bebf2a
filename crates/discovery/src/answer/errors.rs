//! Prediction errors on data that no decision used.
//!
//! Records held out from the beginning are predicted by the fits to the others. Where there are too few to
//! hold any out, fits and choice among the fitted sets are repeated without each fifth of the data, which is
//! then predicted (nested cross-validation: Varma and Simon 2006).

use crate::addition::kinds;
use crate::columns::Family;
use crate::error_table::ForecastErrors;
use crate::examples::examples;
use crate::fit::{Fit, fit_nuisance, merge_nuisances};
use crate::free_runs::{FreeRuns, mean_error};
use crate::prepare::Prepared;
use crate::records::View;
use crate::residuals::{self, outlying_windows};
use crate::result::Example;
use crate::score::Scored;
use crate::search::{Search, SearchResult, refit_on, repeat_choice};
use rayon::prelude::*;

/// Number of folds of the cross-validation, where there are too few records to hold some out.
pub(crate) const FOLDS: usize = 5;

/// Prediction errors on data that no decision used.
pub(crate) struct Errors {
    pub lists: ForecastErrors,
    /// Names of the effects that were found without each fold, `[fold][effect]`; empty where records were
    /// held out.
    pub folds: Vec<Vec<String>>,
    /// Typical prediction on the first fold by the fits without it; `None` where records were held out.
    pub example: Option<Example>,
    /// Errors of simulations of whole recordings: calibrated, augmented model. `None` if there are none.
    pub free_run: Option<[f64; 2]>,
}

/// For the calibrated and the augmented model: sum of squared errors and number of samples of each channel.
type Sums = [Vec<(f64, f64)>; 2];

/// Prediction errors on one part of the data, by fits that have not used it.
struct Predicted {
    lists: ForecastErrors,
    /// Sums of squared errors of simulations of whole recordings; `None` if there are none.
    free_runs: Option<Sums>,
    found: Vec<String>,
    /// Typical prediction of a fold.
    example: Option<Example>,
}

/// Measures prediction errors on the held-out records, or by cross-validation if no records were held out.
/// The fits are those of the calibrated model and of the set with index `best`.
pub(crate) fn measure_errors(
    prepared: &Prepared,
    joined: usize,
    families: &[Family],
    known: &SearchResult,
    best: usize,
    seed: u64,
) -> Errors {
    let (base, best) = (known.base(), &known.sets[best]);
    if !prepared.held_out.is_empty() {
        return errors_of_fits(prepared, &prepared.held_out, [&base.fit, &best.fit], seed);
    }
    let folds = folds(prepared);
    let predict_fold = |fold: &Vec<usize>| {
        let others: Vec<usize> = prepared.searched.iter().copied().filter(|j| !fold.contains(j)).collect();
        let view = View::new(prepared, &others, joined);
        let sample = view.sample();
        let start = Scored::new(&sample, &view.blocks, refit_on(&view, &base.fit));
        let search = Search::new(&view, families, &prepared.clock);
        // What the choice finds in a fold is no error of a result that adds nothing.
        let (found, named) = if best.additions().is_empty() {
            (SearchResult::calibrated_only(start, known.penalty), 0)
        } else {
            let mut found = repeat_choice(&search, start, known);
            let named = crate::judge::named_set(&search, &mut found);
            (found, named)
        };
        let (calibrated, augmented) = (&found.base().fit, &found.sets[named].fit);
        let on_fold = predicted(prepared, fold, [calibrated, augmented], seed);
        let mut shown = examples(&prepared.sample(fold), [calibrated, augmented], &on_fold.lists);
        // Of three predictions, the median one is second.
        let typical = if shown.is_empty() { None } else { Some(shown.swap_remove(shown.len() / 2)) };
        Predicted { found: kinds(&augmented.hypothesis.additions), example: typical, ..on_fold }
    };
    let done: Vec<Predicted> = folds.par_iter().map(predict_fold).collect();
    let mut out =
        Errors { lists: ForecastErrors::default(), folds: Vec::new(), example: None, free_run: None };
    let mut runs = Vec::new();
    for predicted in done {
        out.lists.extend(predicted.lists);
        out.folds.push(predicted.found);
        runs.push(predicted.free_runs);
        out.example = out.example.or(predicted.example);
    }
    out.free_run = means(&runs);
    out
}

/// Measures prediction errors of the fits (calibrated, augmented) on `records`, without refits.
pub(crate) fn errors_of_fits(prepared: &Prepared, records: &[usize], fits: [&Fit; 2], seed: u64) -> Errors {
    let predicted = predicted(prepared, records, fits, seed);
    let free_run = means(&[predicted.free_runs]);
    Errors { lists: predicted.lists, folds: Vec::new(), example: None, free_run }
}

/// Records of each cross-validation fold: every fifth record, by order. The only record of a group is in no
/// fold, because without it nothing is known about the group.
fn folds(prepared: &Prepared) -> Vec<Vec<usize>> {
    let data = &prepared.data;
    let group = |j: usize| data.records[j].data.group;
    let of_group = |g: usize| prepared.searched.iter().filter(move |j| group(**j) == g).count();
    let records: Vec<usize> = prepared.searched.iter().copied().filter(|j| of_group(group(*j)) > 1).collect();
    let count = FOLDS.min(records.len());
    (0..count).map(|f| records.iter().copied().skip(f).step_by(count).collect()).collect()
}

/// Predicts `records` by fits (calibrated, augmented) that have not used them.
fn predicted(prepared: &Prepared, records: &[usize], [base, best]: [&Fit; 2], seed: u64) -> Predicted {
    let sample = prepared.sample(records);
    let with_nuisances = |f: &Fit| fit_nuisance(&sample, &f.hypothesis, &f.theta, &[]);
    let held = with_nuisances(best);
    let limit = forecast_limit(prepared, &held);
    let excluded =
        if limit.is_finite() { outlying_windows(limit, [&with_nuisances(base), &held]) } else { Vec::new() };
    let lists = ForecastErrors::measure(&sample, [base, best], &held, &excluded, seed);
    let free_runs = FreeRuns::new(&sample).map(|runs| [base, best].map(|fit| summed(runs.squares(fit))));
    Predicted { lists, free_runs, found: Vec::new(), example: None }
}

/// Mean squared residual, in units of the noise variance, above which a window is excluded from the prediction
/// errors.
///
/// It is infinite, so that no window is excluded, unless the laws of the system are idealised.
pub(crate) fn forecast_limit(prepared: &Prepared, best: &Fit) -> f64 {
    if prepared.data.is_idealised() { residuals::limit(best) } else { f64::INFINITY }
}

/// Sums squared errors and numbers of samples over segments, channel by channel.
fn summed(stretches: Vec<Vec<(f64, f64)>>) -> Vec<(f64, f64)> {
    let add = |a: Vec<(f64, f64)>, b: Vec<(f64, f64)>| {
        a.iter().zip(&b).map(|(a, b)| (a.0 + b.0, a.1 + b.1)).collect()
    };
    stretches.into_iter().reduce(add).unwrap_or_default()
}

/// Errors of whole-recording simulations over several parts of the data: calibrated, augmented model. `None`
/// if a part has none.
fn means(parts: &[Option<Sums>]) -> Option<[f64; 2]> {
    let parts: Option<Vec<&Sums>> = parts.iter().map(Option::as_ref).collect();
    let parts = parts.filter(|parts| !parts.is_empty())?;
    Some([0, 1].map(|model| mean_error(&summed(parts.iter().map(|part| part[model].clone()).collect()))))
}

/// Nuisances (initial states, record parameters, event offsets) of all records in the shortest windows; those of
/// the searched ones are in `set`.
pub(crate) fn nuisances_of_all(prepared: &Prepared, set: &Fit) -> Vec<Vec<f64>> {
    let held_out = prepared.sample(&prepared.held_out);
    let held = fit_nuisance(&held_out, &set.hypothesis, &set.theta, &[]);
    merge_nuisances(&[(&prepared.sample(&prepared.searched), set), (&held_out, &held)])
}
