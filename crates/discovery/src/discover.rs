//! The loop: noise, calibration, search, adequacy, unlisted laws, verdict, errors.

use crate::anatomy::anatomy;
use crate::answer::Parts;
use crate::calibrate::calibrate;
use crate::crossed::{crossed, worth_crossing};
use crate::decide::{Decided, decide, heldout_gain};
use crate::error_table::{Lists, measured_in};
use crate::fit::{fit, merged};
use crate::prepare::{Prepared, prepare};
use crate::report::report;
use crate::result::{Discovery, ErrorTable};
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
    let Decided { found, base, best, tests, verdict, severe } = decide(&mut search, base, true, progress)
        .ok_or_else(|| DiscoveryError::TooFew { data: measured.name.clone(), found: 0 })?;

    progress(Progress::Errors);
    let gain = heldout_gain(&best, &base).unwrap_or(0.0);
    let (unit, _) = measured_in(measured.system.schema());
    let lists = Lists::of(&search.test, [&base.fit, &best.fit], options.seed);
    let mut error = lists.table(&unit, options.seed, gain);
    let crossed = if worth_crossing(&best, &error) {
        progress(Progress::Folds);
        crossed(&prepared, options)
    } else {
        None
    };
    if let Some(c) = &crossed {
        error = ErrorTable { folds: Some(c.found.len()), ..c.lists.table(&unit, options.seed, gain) };
    }
    let everything: Vec<usize> = (0..measured.records.len()).collect();
    let all = prepared.sample(&everything);
    let full = |j: &Judged| {
        let held = search.heldout(&j.fit);
        let nuisance = merged(&[(&search.train, &j.fit), (&search.test, &held)]);
        fit(&all, &j.fit.hypothesis, &j.fit.theta, &nuisance)
    };
    let (calibrated, last) = (full(&base), full(&best));
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
