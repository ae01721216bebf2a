//! The loop: noise, calibration, search, adequacy, unlisted laws, verdict, errors.

use crate::DiscoveryError;
use crate::anatomy::anatomy;
use crate::answer::AnswerParts;
use crate::calibrate::calibrate;
use crate::candidates::Family;
use crate::crossed::{crossed, forecast_limit, worth_crossing};
use crate::cut::cut_short;
use crate::decide::{Decided, JudgedBy, heldout_gain, with_only};
use crate::doubt::{Doubt, after_search, before_search, unsearched};
use crate::end_of_sensor::with_stops;
use crate::error_table::Lists;
use crate::examples::examples;
use crate::fit::{Fit, fit, fit_nuisance, merged};
use crate::formulas::{answer, beyond_the_library, leaves_something};
use crate::grammar::has_grammar;
use crate::judged::Judged;
use crate::long_search::over_long_windows;
use crate::longer::fit_joined;
use crate::options::{Options, Progress, onward};
use crate::outliers::left_out;
use crate::prepare::{Prepared, prepare};
use crate::report::report;
use crate::result::{Discovery, ErrorTable, FreeRun, Verdict, Windows};
use crate::scattered;
use crate::search::Search;
use crate::shaken::under_noise_of_the_motion;
use crate::supported::supported_by_all;
use crate::tables::beyond_formulas;
use augsim_data::checks::{Admitted, admit};
use augsim_data::{DataError, Dataset};
use augsim_physics::system::Declaration;
use std::time::Instant;

/// Finds what `model` lacks to explain `data`.
///
/// Deterministic: the same inputs and seed give the same answer for any number of threads. The crate's documentation has an
/// example that runs, and the sources of the method.
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
    let progress = &mut onward(progress);
    progress(Progress::Noise);
    let Admitted { data, warnings } =
        admit(data.clone(), &model.expected(), options.accepted).map_err(DataError::from)?;
    let mut prepared = prepare(model, &data, options)?;
    let mut doubt = before_search(&prepared);
    let (mut decided, mut family) = match &doubt {
        Some(_) => {
            progress(Progress::Calibration);
            let family = Family::Described;
            let search = Search::on(&prepared, family);
            (unsearched(&search, calibrate(&search.train)), family)
        }
        None => answer(&prepared, options, None, progress)?,
    };
    if doubt.is_none() && !prepared.clock.was_cut() && prepared.quieter(&decided.best.fit) {
        // What was noise beside the declared model may be structure beside the augmented one: the search goes on from there.
        (decided, family) = answer(&prepared, options, Some(&decided), progress)?;
    }
    let goes_on = doubt.is_none() && !prepared.clock.was_cut() && family == Family::Described;
    let has_recordings = !prepared.data.recordings.is_empty();
    if has_recordings && goes_on && leaves_something(&prepared, &decided) {
        progress(Progress::LongWindows);
        decided = over_long_windows(&prepared, decided, family, progress);
        decided = with_stops(&prepared, &data, decided, family, progress);
    }
    if has_grammar(&*prepared.data.system)
        && goes_on
        && leaves_something(&prepared, &decided)
        && let Some(wider) = beyond_the_library(&prepared, &decided, progress)
    {
        (decided, family) = (wider, Family::Grammar);
    }
    let is_open = doubt.is_none() && !prepared.clock.was_cut();
    if has_grammar(&*prepared.data.system) && is_open && leaves_something(&prepared, &decided) {
        decided = beyond_formulas(&prepared, decided, family, progress);
    }
    let search = Search::on(&prepared, family);
    if is_open && leaves_something(&prepared, &decided) {
        decided = under_noise_of_the_motion(&search, decided, progress);
    }
    let Prepared { data: measured, noise, .. } = &prepared;
    // How many windows of the search each window of the final fits joins, and what the search came to over its own windows: of the
    // calibrated model and of the best.
    let mut joined = [None; 2];
    let mut searched = [decided.base.clone(), decided.best.clone()];
    let (of_base, of_best) = rayon::join(
        || search.over_longer_windows(&decided.base),
        || search.over_longer_windows(&decided.best),
    );
    let sets = [(&mut decided.base, of_base), (&mut decided.best, of_best)];
    for ((judged, better), joined) in sets.into_iter().zip(&mut joined) {
        if let Some((better, length)) = better {
            (*judged, *joined) = (better, Some(length));
        }
    }
    let was_cut = prepared.clock.was_cut();

    progress(Progress::Errors);
    let (schema, seed) = (measured.system.schema(), options.seed);
    let mut limit = forecast_limit(measured, &decided.best.fit);
    let on_split = |decided: &Decided, limit: f64| {
        let (base, best) = (&decided.base, &decided.best);
        let held = search.heldout(best);
        let out = if limit.is_finite() { left_out(limit, [search.heldout(base), held]) } else { Vec::new() };
        Lists::of(&search.test, [&base.fit, &best.fit], held, &out, seed)
    };
    let gain_of = |decided: &Decided| heldout_gain(&decided.best, &decided.base).unwrap_or(0.0);
    let mut lists = on_split(&decided, limit);
    // Shown, not decided on: made from the fits of the training part.
    let mut shown = lists.clone();
    let mut folds = Vec::new();
    if !was_cut && worth_crossing(measured, &decided.best, &lists.first(schema, seed, gain_of(&decided))) {
        progress(Progress::Folds);
        if let Some(crossed) = crossed(&prepared, family, options) {
            let stable = crossed.stable(decided.best.additions());
            if measured.is_idealised() && stable.len() < decided.best.additions().len() {
                decided = with_only(&search, decided, &stable, progress);
                (joined[1], searched[1]) = (None, decided.best.clone());
                shown = on_split(&decided, limit);
            }
            (lists, folds) = (crossed.lists, crossed.found);
        }
    }
    let everything: Vec<usize> = (0..measured.records.len()).collect();
    let all = prepared.sample(&everything);
    let full = |j: &Judged, joined: Option<usize>| {
        let nuisance = merged(&[(&search.train, &j.fit), (&search.test, search.heldout(j))]);
        let Fit { hypothesis, theta, .. } = &j.fit;
        match joined {
            Some(joined) => fit_joined(&all, &fit_nuisance(&all, hypothesis, theta, &nuisance), joined),
            None => fit(&all, hypothesis, theta, &nuisance),
        }
    };
    let mut last = full(&decided.best, joined[1]);
    // What all of the data leave at its null is no finding, though a part of them took it for one; then, one after the other, what all of
    // them do not tell from nothing. (A filter's ratio of likelihoods tells more than intervals over a few windows.)
    let moved = last.moved();
    let is_less = !moved.is_empty() && moved.len() < decided.best.additions().len();
    let mut moving = is_less.then_some((moved, None));
    loop {
        let untold = || {
            let of_windows = decided.judged_by == JudgedBy::Windows;
            let (found, sets) = (&mut decided.found, [&decided.base, &searched[1]]);
            let rest = of_windows.then(|| supported_by_all(&search, found, sets, &last)).flatten()?;
            Some((rest, joined[1]))
        };
        let Some((rest, over)) = moving.take().or_else(untold) else { break };
        decided = with_only(&search, decided, &rest, progress);
        searched[1] = decided.best.clone();
        let longer = over.and_then(|joined| search.over_windows_joined(&decided.best, joined));
        joined[1] = over.filter(|_| longer.is_some());
        decided.best = longer.unwrap_or(decided.best);
        shown = on_split(&decided, limit);
        if folds.is_empty() {
            lists = shown.clone();
        }
        last = full(&decided.best, joined[1]);
    }
    let tables = |lists: &Lists, folds: usize, gain: f64| {
        let folds = (folds > 0).then_some(folds);
        let mut others = lists.others(schema, seed, gain);
        others.values_mut().for_each(|table| table.folds = folds);
        (ErrorTable { folds, ..lists.first(schema, seed, gain) }, others)
    };
    let (mut error, mut errors) = tables(&lists, folds.len(), gain_of(&decided));
    if doubt.is_none() {
        let all: Vec<&ErrorTable> = std::iter::once(&error).chain(errors.values()).collect();
        if let Some(found) = after_search(&search, &decided, &all) {
            let mut plain = unsearched(&search, decided.base.fit.clone());
            match found {
                Doubt::NotThisSystem(why) => doubt = Some(why),
                Doubt::NothingHelps => (plain.verdict, plain.severe) = (Verdict::Unknown, true),
            }
            decided.found.pool.retain(|j| j.additions().is_empty());
            decided = Decided { found: decided.found, ..plain };
            limit = forecast_limit(measured, &decided.best.fit);
            lists = on_split(&decided, limit);
            shown = lists.clone();
            (error, errors) = tables(&lists, 0, 0.0);
            folds = Vec::new();
            (joined[1], searched[1]) = (joined[0], searched[0].clone());
            last = full(&decided.best, joined[1]);
        }
    }
    let Decided { found, base, best, tests, verdict, severe, scattered, .. } = decided;
    error.free_run = FreeRun::of(&*measured.system, base.free_run, best.free_run);
    if prepared.is_bounded() {
        // What was reached is a lower bound of the noise.
        for table in std::iter::once(&mut error).chain(errors.values_mut()) {
            if table.noise_floor.rmse > table.augmented.rmse {
                table.noise_floor = table.augmented;
            }
        }
    }
    let is_same = best.additions().is_empty() && best.fit.theta == base.fit.theta && joined[0] == joined[1];
    let calibrated = if is_same { last.clone() } else { full(&base, joined[0]) };
    let residual_anatomy = anatomy(&all, &calibrated, &last);
    let out = if limit.is_finite() {
        let parts = [[&base.fit, &best.fit], [&base, &best].map(|j| search.heldout(j))];
        parts.map(|fits| left_out(limit, fits).into_iter().filter(|out| *out).count())
    } else {
        [0; 2]
    };
    let drawn_sd = scattered.as_ref().and_then(|_| scattered::size(&all, &last));
    let discovery = report(AnswerParts {
        model,
        search: &search,
        noise,
        found: &found,
        base: &base,
        best: &best,
        searched: [&searched[0], &searched[1]],
        joined: joined[1],
        full: &last,
        tests: &tests,
        verdict,
        doubt,
        severe,
        error,
        errors,
        horizons: lists.horizons(schema, seed),
        windows: limit.is_finite().then(|| Windows {
            fitted: [&search.train, &search.test].map(|sample| sample.excerpts().len()),
            left_out: out,
            rule: format!(
                "left out where both the calibrated and the augmented model miss by more than {:.2} noise standard deviations (root mean square): three times the typical misfit",
                limit.sqrt()
            ),
        }),
        scattered: scattered.as_ref(),
        drawn_sd,
        folds,
        anatomy: residual_anatomy,
    })?;
    let examples = examples(&search.test, [&base.fit, &best.fit], &shown);
    let mut notes = prepared.notes.clone();
    if !data.notes().is_empty() {
        notes.insert(0, format!("{}: read as a recording: {}", data.origin(), data.notes().join("; ")));
    }
    let discovery = Discovery { warnings, notes, examples, ..discovery };
    Ok(if was_cut { cut_short(discovery, begun) } else { discovery })
}
