//! The loop: noise, calibration, search, adequacy, unlisted laws, verdict, errors.

use crate::anatomy::anatomy;
use crate::answer::Parts;
use crate::calibrate::calibrate;
use crate::crossed::{crossed, forecast_limit, worth_crossing};
use crate::decide::{Decided, decide, heldout_gain, place_of, settle};
use crate::error_table::Lists;
use crate::fit::{fit, merged};
use crate::outliers::left_out;
use crate::prepare::{Prepared, prepare};
use crate::report::report;
use crate::result::{Discovery, ErrorTable, Windows};
use crate::scattered;
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
    let prepared = prepare(model, &data, options)?;
    let Prepared { data: measured, noise, train, test } = &prepared;
    let mut search = Search::new(prepared.sample(train), prepared.sample(test));

    progress(Progress::Calibration);
    let base = calibrate(&search.train);
    let mut decided = decide(&mut search, base, true, progress)
        .ok_or_else(|| DiscoveryError::TooFew { data: measured.name.clone(), found: 0 })?;

    progress(Progress::Errors);
    let schema = measured.system.schema();
    let limit = forecast_limit(measured, &decided.best.fit);
    let (seed, gain) = (options.seed, heldout_gain(&decided.best, &decided.base).unwrap_or(0.0));
    let mut lists = Lists::of(&search.test, [&decided.base.fit, &decided.best.fit], limit, seed);
    let mut folds = Vec::new();
    if worth_crossing(measured, &decided.best, &lists.first(schema, seed, gain)) {
        progress(Progress::Folds);
        if let Some(crossed) = crossed(&prepared, options) {
            if measured.is_idealised() {
                let stable = crossed.stable(decided.best.additions());
                if stable.len() < decided.best.additions().len() {
                    let Decided { mut found, base, best, .. } = decided;
                    let best = place_of(&search, &mut found, &best, &stable);
                    decided = settle(&search, found, base, best, true, progress);
                }
            }
            (lists, folds) = (crossed.lists, crossed.found);
        }
    }
    let count = (!folds.is_empty()).then_some(folds.len());
    let gain = heldout_gain(&decided.best, &decided.base).unwrap_or(0.0);
    let error = ErrorTable { folds: count, ..lists.first(schema, seed, gain) };
    let mut errors = lists.others(schema, seed, gain);
    errors.values_mut().for_each(|table| table.folds = count);
    let Decided { found, base, best, tests, verdict, severe, scattered } = decided;
    let everything: Vec<usize> = (0..measured.records.len()).collect();
    let all = prepared.sample(&everything);
    let full = |j: &Judged| {
        let held = search.heldout(&j.fit);
        let nuisance = merged(&[(&search.train, &j.fit), (&search.test, &held)]);
        fit(&all, &j.fit.hypothesis, &j.fit.theta, &nuisance)
    };
    let (calibrated, last) = (full(&base), full(&best));
    let residual_anatomy = anatomy(&all, &calibrated, &last);
    let out = if limit.is_finite() {
        let held = [&base, &best].map(|j| search.heldout(&j.fit));
        let parts = [[&base.fit, &best.fit], held.each_ref()];
        parts.map(|fits| left_out(limit, fits).into_iter().filter(|out| *out).count())
    } else {
        [0; 2]
    };
    let drawn_sd = scattered.as_ref().and_then(|_| scattered::size(&all, &last));
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
        errors,
        horizons: lists.horizons(schema, seed),
        windows: Windows {
            fitted: [&search.train, &search.test].map(|sample| sample.excerpts().len()),
            left_out: out,
            rule: limit.is_finite().then(|| {
                format!(
                    "left out where both the calibrated and the augmented model miss by more than {:.2} noise standard deviations (root mean square): three times the typical misfit",
                    limit.sqrt()
                )
            }),
        },
        scattered: scattered.as_ref(),
        drawn_sd,
        folds,
        anatomy: residual_anatomy,
    })?;
    Ok(Discovery { warnings, ..discovery })
}
