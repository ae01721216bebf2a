//! The loop: noise, calibration, search, adequacy, unlisted laws, verdict, errors.

use crate::anatomy::anatomy;
use crate::answer::Parts;
use crate::candidates::Family;
use crate::crossed::{crossed, worth_crossing};
use crate::decide::{Decided, heldout_gain};
use crate::error_table::{Lists, measured_in};
use crate::fit::{fit, merged};
use crate::formulas::{answer, beyond_the_library, has_grammar};
use crate::free_runs::fit_whole;
use crate::judged::is_inert;
use crate::prepare::{Prepared, prepare};
use crate::report::report;
use crate::result::{Discovery, ErrorTable, FreeRun};
use crate::search::{Judged, Search};
use crate::{DiscoveryError, Options, Progress};
use augsim_data::checks::{Admitted, admit};
use augsim_data::{DataError, Dataset};
use augsim_physics::system::Declaration;

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
    progress(Progress::Noise);
    let Admitted { data, warnings } =
        admit(data.clone(), &model.expected(), options.accepted).map_err(DataError::from)?;
    let mut prepared = prepare(model, &data, options)?;
    let (mut decided, mut family) = answer(&prepared, options, None, progress)?;
    if prepared.quieter(&decided.best.fit) {
        // What was noise beside the declared model may be structure beside the augmented one: the search goes on from there.
        (decided, family) = answer(&prepared, options, Some(&decided), progress)?;
    }
    if has_grammar(&prepared) && family == Family::Described && !decided.tests.ok() {
        // Only what the tests see is worth a formula.
        if let Some(wider) = beyond_the_library(&prepared, &decided, progress) {
            (decided, family) = (wider, Family::Grammar);
        }
    }
    let search = Search::new(prepared.sample(&prepared.train), prepared.sample(&prepared.test), family);
    let Prepared { data: measured, noise, .. } = &prepared;
    let Decided { found, base, best, tests, verdict, severe } = decided;
    let [(base, long_base), (best, long_best)] =
        [base, best].map(|j| match search.over_whole_recordings(&j) {
            Some(better) => (better, true),
            None => (j, false),
        });

    let everything: Vec<usize> = (0..measured.records.len()).collect();
    let all = prepared.sample(&everything);
    let full = |j: &Judged, is_long: bool| {
        let held = search.heldout(&j.fit);
        let nuisance = merged(&[(&search.train, &j.fit), (&search.test, &held)]);
        let windows = fit(&all, &j.fit.hypothesis, &j.fit.theta, &nuisance);
        if is_long { fit_whole(&all, &windows) } else { windows }
    };
    let (calibrated, mut last) = (full(&base, long_base), full(&best, long_best));
    let mut best = best;
    while let Some(idle) = (0..best.additions().len()).find(|&n| long_best && is_inert(&last, n)) {
        // With all data an effect of the training part may come to nothing.
        let mut rest = best.additions().to_vec();
        rest.remove(idle);
        let without = search.refit(&best.fit, &rest, &[]);
        let held = search.heldout(&without.fit).ll;
        best = search.over_whole_recordings(&without).unwrap_or(Judged { heldout_ll: Some(held), ..without });
        last = full(&best, long_best);
    }

    progress(Progress::Errors);
    let gain = heldout_gain(&best, &base).unwrap_or(0.0);
    let (unit, _) = measured_in(measured.system.schema());
    let lists = Lists::of(&search.test, [&base.fit, &best.fit], options.seed);
    let mut error = lists.table(&unit, options.seed, gain);
    let crossed = if worth_crossing(&best, &error) {
        progress(Progress::Folds);
        crossed(&prepared, family, options)
    } else {
        None
    };
    if let Some(c) = &crossed {
        error = ErrorTable { folds: Some(c.found.len()), ..c.lists.table(&unit, options.seed, gain) };
    }
    error.free_run = FreeRun::of(&*measured.system, base.free_run, best.free_run);
    if !prepared.smooth && error.noise_floor.rmse > error.augmented.rmse {
        // The noise was only bounded: what was reached is a lower bound.
        error.noise_floor = error.augmented;
    }
    let residual_anatomy = anatomy(&all, &calibrated, &last);
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
        severe,
        error,
        folds: crossed.map_or_else(Vec::new, |c| c.found),
        anatomy: residual_anatomy,
    })?;
    Ok(Discovery { warnings, ..discovery })
}
