//! The loop: noise, calibration, search, adequacy, unlisted laws, verdict, errors.

use crate::anatomy::anatomy;
use crate::answer::Parts;
use crate::calibrate::calibrate;
use crate::candidates::Family;
use crate::crossed::{crossed, worth_crossing};
use crate::cut::cut_short;
use crate::decide::{Decided, heldout_gain};
use crate::doubt::{after_search, before_search, unsearched};
use crate::error_table::{Lists, measured_in};
use crate::examples::examples;
use crate::fit::{fit, merged};
use crate::formulas::{answer, beyond_the_library, has_grammar, leaves_something};
use crate::free_runs::fit_whole;
use crate::prepare::{Prepared, prepare};
use crate::report::report;
use crate::result::{Discovery, ErrorTable, FreeRun};
use crate::search::{Judged, Search};
use crate::{DiscoveryError, Options, Progress};
use augsim_data::checks::{Admitted, admit};
use augsim_data::{DataError, Dataset};
use augsim_physics::system::Declaration;
use std::time::Instant;

/// Finds what `model` lacks to explain `data`.
///
/// Deterministic: the same inputs and seed give the same answer for any number of threads. Source of the method: see the
/// crate's documentation.
///
/// # Errors
/// [`DiscoveryError`], when the data or the model do not allow an answer.
pub fn discover(
    model: &dyn Declaration,
    data: &Dataset,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<Discovery, DiscoveryError> {
    let begun = Instant::now();
    progress(Progress::Noise);
    let Admitted { data, warnings } =
        admit(data.clone(), &model.expected(), options.accepted).map_err(DataError::from)?;
    let mut prepared = prepare(model, &data, options)?;
    let mut doubt = before_search(&prepared);
    let (mut decided, mut family) = match &doubt {
        Some(_) => {
            progress(Progress::Calibration);
            let family = Family::Described;
            let [train, test] = [&prepared.train, &prepared.test].map(|chosen| prepared.sample(chosen));
            let search = Search::new(train, test, family, options);
            (unsearched(&search, calibrate(&search.train)), family)
        }
        None => answer(&prepared, options, None, progress)?,
    };
    if doubt.is_none() && !decided.was_cut && prepared.quieter(&decided.best.fit) {
        // What was noise beside the declared model may be structure beside the augmented one: the search goes on from there.
        (decided, family) = answer(&prepared, options, Some(&decided), progress)?;
    }
    let goes_on = doubt.is_none() && !decided.was_cut && family == Family::Described;
    if has_grammar(&prepared) && goes_on && !decided.tests.ok() && leaves_something(&prepared, &decided) {
        // Only what the tests see, and what is more than the noise, is worth a formula.
        if let Some(wider) = beyond_the_library(&prepared, &decided, options, progress) {
            (decided, family) = (wider, Family::Grammar);
        }
    }
    let [train, test] = [&prepared.train, &prepared.test].map(|chosen| prepared.sample(chosen));
    let search = Search::new(train, test, family, options);
    let Prepared { data: measured, noise, .. } = &prepared;
    let Decided { mut found, base, best, mut tests, mut verdict, mut severe, was_cut } = decided;
    let [(base, long_base), (mut best, mut long_best)] =
        [base, best].map(|j| match search.over_whole_recordings(&j) {
            Some(better) => (better, true),
            None => (j, false),
        });

    progress(Progress::Errors);
    let gain = heldout_gain(&best, &base).unwrap_or(0.0);
    let (unit, _) = measured_in(measured.system.schema());
    let lists = Lists::of(&search.test, [&base.fit, &best.fit], options.seed);
    let mut error = lists.table(&unit, options.seed, gain);
    let mut errors = lists.by_trajectory();
    let mut crossed = if worth_crossing(&best, &error) && !was_cut {
        progress(Progress::Folds);
        crossed(&prepared, family, options)
    } else {
        None
    };
    if let Some(c) = &crossed {
        error = ErrorTable { folds: Some(c.found.len()), ..c.lists.table(&unit, options.seed, gain) };
    }
    if doubt.is_none() {
        doubt = after_search(&best, verdict, &error, measured.system.schema().decides());
        if doubt.is_some() {
            let plain = unsearched(&search, base.fit.clone());
            (best, tests, verdict, severe) = (plain.best, plain.tests, plain.verdict, false);
            found.pool.retain(|j| j.additions().is_empty());
            let lists = Lists::of(&search.test, [&base.fit, &best.fit], options.seed);
            (error, errors) = (lists.table(&unit, options.seed, 0.0), lists.by_trajectory());
            crossed = None;
            long_best = long_base;
        }
    }
    error.free_run = FreeRun::of(&*measured.system, base.free_run, best.free_run);
    if !prepared.smooth && error.noise_floor.rmse > error.augmented.rmse {
        // The noise was only bounded: what was reached is a lower bound.
        error.noise_floor = error.augmented;
    }
    let everything: Vec<usize> = (0..measured.records.len()).collect();
    let all = prepared.sample(&everything);
    let full = |j: &Judged, is_long: bool| {
        let held = search.heldout(&j.fit);
        let nuisance = merged(&[(&search.train, &j.fit), (&search.test, &held)]);
        let windows = fit(&all, &j.fit.hypothesis, &j.fit.theta, &nuisance);
        if is_long { fit_whole(&all, &windows) } else { windows }
    };
    let (calibrated, last) = (full(&base, long_base), full(&best, long_best));
    let residual_anatomy = anatomy(&all, &calibrated, &last);
    // Shown, not decided on: made from the fits of the training part.
    let examples = || examples(&search.test, [&base.fit, &best.fit], &errors);
    let discovery = report(Parts {
        model,
        search: &search,
        noise,
        found: &found,
        base: &base,
        best: &best,
        full: &last,
        tests: &tests,
        verdict,
        doubt,
        severe,
        error,
        folds: crossed.map_or_else(Vec::new, |c| c.found),
        anatomy: residual_anatomy,
    })?;
    let examples = examples();
    let mut notes = prepared.notes.clone();
    if !data.notes().is_empty() {
        notes.insert(0, format!("{}: read as a recording: {}", data.origin(), data.notes().join("; ")));
    }
    let discovery = Discovery { warnings, notes, examples, ..discovery };
    Ok(if was_cut { cut_short(discovery, begun) } else { discovery })
}
