//! The loop: noise, calibration, search, adequacy, unlisted laws, verdict, errors.

use crate::anatomy::anatomy;
use crate::answer::Parts;
use crate::calibrate::calibrate;
use crate::crossed::{crossed, worth_crossing};
use crate::decide::{Decided, decide, heldout_gain};
use crate::error_table::Lists;
use crate::fit::{Sample, fit};
use crate::prepare::{Prepared, prepare};
use crate::report::report;
use crate::result::{Discovery, ErrorTable};
use crate::search::{Judged, Search};
use crate::statistics::median;
use crate::{DiscoveryError, Options, Progress};
use augsim_data::checks::{Admitted, admit};
use augsim_data::{DataError, Dataset};
use augsim_physics::ball::GRAVITY;
use augsim_physics::model::Model;

/// Share of the spread of the first flight that gravity with a free start may leave: twice that of a ball at half its
/// terminal speed, below the quarter that wrong units leave.
const HOPELESS: f64 = 0.2;

/// Finds what `model` lacks to explain `data`.
///
/// Deterministic: the same inputs and seed give the same answer for any number of threads. Source of the method: see the
/// crate's documentation.
///
/// # Errors
/// [`DiscoveryError`], when the data or the model do not allow an answer.
pub fn discover(
    model: &Model,
    data: &Dataset,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<Discovery, DiscoveryError> {
    progress(Progress::Noise);
    let Admitted { data, warnings } =
        admit(data.clone(), &model.expected(), options.accepted).map_err(DataError::from)?;
    let prepared = prepare(model, &data, options)?;
    let Prepared { data: measured, noise, train, test } = &prepared;
    let mut search = Search::new(model, prepared.sample(train), prepared.sample(test));

    progress(Progress::Calibration);
    check_calibration(model, &search.train)?;
    let base = calibrate(model, &search.train);
    let Decided { found, base, best, tests, verdict, severe } = decide(&mut search, base, true, progress)
        .ok_or_else(|| DiscoveryError::TooFew { data: measured.name.clone(), found: 0 })?;

    progress(Progress::Errors);
    let gain = heldout_gain(&best, &base).unwrap_or(0.0);
    let mut error =
        Lists::of(model, &search.test, [&base.fit, &best.fit], options.seed).table(options.seed, gain);
    let crossed = if worth_crossing(&best, &error) {
        progress(Progress::Folds);
        crossed(model, &prepared, options)
    } else {
        None
    };
    if let Some(c) = &crossed {
        error = ErrorTable { folds: Some(c.found.len()), ..c.lists.table(options.seed, gain) };
    }
    let everything: Vec<usize> = (0..measured.records.len()).collect();
    let all = prepared.sample(&everything);
    let full = |j: &Judged| {
        let held = search.heldout(&j.fit);
        let mut nuisance = vec![Vec::new(); everything.len()];
        let parts = train.iter().zip(&j.fit.nuisance).chain(test.iter().zip(&held.nuisance));
        parts.for_each(|(&record, n)| nuisance[record] = n.clone());
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

/// A model that does not even follow the first flight is in other units or upside down.
fn check_calibration(model: &Model, train: &Sample<'_>) -> Result<(), DiscoveryError> {
    let vertical = train.data.axes.count() - 1;
    let mut shares = Vec::new();
    let (mut misfits, mut noises) = (Vec::new(), Vec::new());
    for r in train.records() {
        let (Some(arc), (p, v)) = (r.arcs.first(), r.start) else { continue };
        let (mut n, mut sum, mut square, mut misfit, mut noise) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for k in arc.clone().filter(|&k| r.weight[vertical][k] > 0.0) {
            let (y, t) = (r.y[vertical][k], r.times[k] - r.times[0]);
            let g = model.parameters[GRAVITY].nominal;
            n += 1.0;
            sum += y;
            square += y * y;
            misfit += (y - p[2] - v[2] * t + 0.5 * g * t * t).powi(2);
            noise += r.weight[vertical][k].powi(-2);
        }
        let spread = (square - sum * sum / n).max(0.0);
        let visible = misfit > 100.0 * noise;
        shares.push(if visible { (misfit / spread.max(1e-300)).sqrt() } else { 0.0 });
        misfits.push((misfit / f64::max(n, 1.0)).sqrt());
        noises.push((noise / f64::max(n, 1.0)).sqrt());
    }
    if median(&mut shares) < HOPELESS {
        return Ok(());
    }
    let (rmse, sd) = (median(&mut misfits), median(&mut noises));
    Err(DiscoveryError::NotCalibrated {
        model: model.file.clone(),
        data: train.data.name.clone(),
        rmse_m: rmse,
        sd_m: sd,
    })
}
